/* ---- Lanes: what a query costs at least in 16 boxes at once, and about what it costs in 8 frames.
 *
 * Bounds are sums of whole numbers, which have no order. Costs are in float32, and each lane adds its own features one after another.
 * So both have the same bits whatever the width of registers; a machine that has AVX2 is asked for at run time. */

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define CDBM_LANES 16
#define CDBM_FRAMES 8               /* so many frames are scored at once */
#define CDBM_FEW 5                  /* after so many pairs of features bounds are compared with the limit */

#if defined(__GNUC__)
#define CDBM_INLINE static inline __attribute__((always_inline))
typedef float cdbm_floats __attribute__((vector_size(32), aligned(4), may_alias)); /* so many lanes of costs at once */
#define CDBM_PART 8
#else
#define CDBM_INLINE static inline
typedef float cdbm_floats;
#define CDBM_PART 1
#endif
#if defined(__GNUC__) && defined(__x86_64__) && !defined(CDBM_NARROW)
#define CDBM_WIDE __attribute__((target("avx2")))
#include <cpuid.h>
#include <immintrin.h>
#endif

/* Which of 16 boxes may hold a frame that costs at most `limit`, a bit each; what each costs at least is left in `totals` where any may.
 * `lows`, `highs` [n_pairs][16][2] and `query` [n_pairs][2] are levels, see frame_boxes.h, so small that no sum is too large. */
static uint32_t cdbm_bounds(const int16_t *lows, const int16_t *highs, const int16_t *query, size_t n_pairs, int32_t limit,
    int32_t *totals)
{
    uint32_t mask = (1U << CDBM_LANES) - 1;
    size_t pair = 0, lane;
    memset(totals, 0, CDBM_LANES * sizeof *totals);
    while (mask && pair < n_pairs) {
        size_t to = n_pairs - pair > CDBM_FEW ? pair + CDBM_FEW : n_pairs;
        for (; pair < to; pair++) {
            const int16_t *low = lows + 2 * CDBM_LANES * pair, *high = highs + 2 * CDBM_LANES * pair, *two = query + 2 * pair;
            for (lane = 0; lane < CDBM_LANES; lane++) {
                int32_t first = (low[2 * lane] > two[0] ? low[2 * lane] : two[0]) - (high[2 * lane] < two[0] ? high[2 * lane] : two[0]);
                int32_t second = (low[2 * lane + 1] > two[1] ? low[2 * lane + 1] : two[1])
                    - (high[2 * lane + 1] < two[1] ? high[2 * lane + 1] : two[1]);
                totals[lane] += first * first + second * second;
            }
        }
        for (mask = 0, lane = 0; lane < CDBM_LANES; lane++) mask |= (totals[lane] > limit ? 0U : 1U) << lane;
    }
    return mask;
}

#ifdef CDBM_WIDE
#define CDBM_WIDE_INLINE CDBM_WIDE CDBM_INLINE

/* Add what a pair of features adds, of 8 boxes each. */
CDBM_WIDE_INLINE void cdbm_add_pair(const int16_t *lows, const int16_t *highs, const int16_t *query, __m256i *sums)
{
    const __m256i *low = (const __m256i *)(const void *)lows, *high = (const __m256i *)(const void *)highs;
    __m256i two, apart;
    int32_t both, half;
    memcpy(&both, query, sizeof both);
    two = _mm256_set1_epi32(both);
    for (half = 0; half < 2; half++) {
        apart = _mm256_sub_epi16(_mm256_max_epi16(_mm256_loadu_si256(low + half), two), _mm256_min_epi16(_mm256_loadu_si256(high + half), two));
        sums[half] = _mm256_add_epi32(sums[half], _mm256_madd_epi16(apart, apart));
    }
}

CDBM_WIDE_INLINE uint32_t cdbm_are_within(const __m256i *sums, int32_t limit)
{
    __m256i first = _mm256_cmpgt_epi32(sums[0], _mm256_set1_epi32(limit)), second = _mm256_cmpgt_epi32(sums[1], _mm256_set1_epi32(limit));
    return ~((uint32_t)_mm256_movemask_ps(_mm256_castsi256_ps(first)) | (uint32_t)_mm256_movemask_ps(_mm256_castsi256_ps(second)) << 8)
        & ((1U << CDBM_LANES) - 1);
}

/* The same, to the last bit. */
CDBM_WIDE static uint32_t cdbm_bounds_wide(const int16_t *lows, const int16_t *highs, const int16_t *query, size_t n_pairs,
    int32_t limit, int32_t *totals)
{
    __m256i sums[2] = {_mm256_setzero_si256(), _mm256_setzero_si256()};
    uint32_t mask = (1U << CDBM_LANES) - 1;
    size_t pair = 0, i;
    while (mask && pair + CDBM_FEW <= n_pairs) {
        for (i = 0; i < CDBM_FEW; i++, pair++) cdbm_add_pair(lows + 32 * pair, highs + 32 * pair, query + 2 * pair, sums);
        mask = cdbm_are_within(sums, limit);
    }
    if (mask && pair < n_pairs) {
        for (; pair < n_pairs; pair++) cdbm_add_pair(lows + 32 * pair, highs + 32 * pair, query + 2 * pair, sums);
        mask = cdbm_are_within(sums, limit);
    }
    memcpy(totals, sums, sizeof sums);
    return mask;
}
#endif

/* Which of 8 frames cost at most `limit`, a bit each; what each costs is left in `totals` where any does. `values` are [n_features][8]. One
 * that is not a number (0 x infinity, where float32 ends) may. */
static uint32_t cdbm_costs(const float *values, const float *query, const float *weights, size_t n_features, float limit, float *totals)
{
    cdbm_floats sums[CDBM_FRAMES / CDBM_PART];
    uint32_t mask = (1U << CDBM_FRAMES) - 1, lane;
    size_t f = 0, part;
    memset(sums, 0, sizeof sums);
    while (mask && f < n_features) {
        size_t to = n_features - f > 2 * CDBM_FEW ? f + 2 * CDBM_FEW : n_features;
        for (; f < to; f++)
            for (part = 0; part < CDBM_FRAMES / CDBM_PART; part++) {
                cdbm_floats apart = *(const cdbm_floats *)(values + CDBM_FRAMES * f + part * CDBM_PART) - query[f];
                sums[part] += weights[f] * apart * apart;
            }
        memcpy(totals, sums, sizeof sums);
        for (mask = 0, lane = 0; lane < CDBM_FRAMES; lane++) mask |= (totals[lane] > limit ? 0U : 1U) << lane;
    }
    return mask;
}

#ifdef CDBM_WIDE
CDBM_WIDE_INLINE __m256 cdbm_add_feature(__m256 sum, const float *values, float query, float weight)
{
    __m256 apart = _mm256_sub_ps(_mm256_loadu_ps(values), _mm256_set1_ps(query));
    return _mm256_add_ps(sum, _mm256_mul_ps(_mm256_mul_ps(_mm256_set1_ps(weight), apart), apart));
}

/* The same, to the last bit. */
CDBM_WIDE static uint32_t cdbm_costs_wide(const float *values, const float *query, const float *weights, size_t n_features, float limit,
    float *totals)
{
    __m256 sum = _mm256_setzero_ps(), most = _mm256_set1_ps(limit);
    uint32_t mask = (1U << CDBM_FRAMES) - 1;
    size_t f = 0, i;
    while (mask && f + 2 * CDBM_FEW <= n_features) {
        for (i = 0; i < 2 * CDBM_FEW; i++, f++) sum = cdbm_add_feature(sum, values + CDBM_FRAMES * f, query[f], weights[f]);
        mask = (uint32_t)_mm256_movemask_ps(_mm256_cmp_ps(sum, most, _CMP_NGT_UQ));
    }
    if (mask && f < n_features) {
        for (; f < n_features; f++) sum = cdbm_add_feature(sum, values + CDBM_FRAMES * f, query[f], weights[f]);
        mask = (uint32_t)_mm256_movemask_ps(_mm256_cmp_ps(sum, most, _CMP_NGT_UQ));
    }
    _mm256_storeu_ps(totals, sum);
    return mask;
}

/* Whether this machine has AVX2, and its system saves its registers. */
static int cdbm_is_wide(void)
{
    uint32_t a, b, c, d, low, high;
    if (!__get_cpuid(1, &a, &b, &c, &d) || !(c >> 27 & 1) || !(c >> 28 & 1)) return 0;
    __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return (low & 6) == 6 && __get_cpuid_count(7, 0, &a, &b, &c, &d) && (b >> 5 & 1);
}
#endif

typedef struct cdbm_lanes {         /* both, as this machine does them best */
    uint32_t (*bounds)(const int16_t *, const int16_t *, const int16_t *, size_t, int32_t, int32_t *);
    uint32_t (*costs)(const float *, const float *, const float *, size_t, float, float *);
} cdbm_lanes;

/* What to work with on this machine: to be asked once, as it takes longer than a search may. */
static inline cdbm_lanes cdbm_best_lanes(void)
{
    cdbm_lanes lanes = {cdbm_bounds, cdbm_costs};
#ifdef CDBM_WIDE
    if (cdbm_is_wide()) {
        lanes.bounds = cdbm_bounds_wide;
        lanes.costs = cdbm_costs_wide;
    }
#endif
    return lanes;
}

/* The lowest bit of a mask that is not 0. */
CDBM_INLINE uint32_t cdbm_lowest(uint32_t mask)
{
#if defined(__GNUC__)
    return (uint32_t)__builtin_ctz(mask);
#else
    uint32_t lane = 0;
    while (!(mask >> lane & 1)) lane++;
    return lane;
#endif
}

/* The lane of the least total among those of a mask that is not 0: looked at first, it spares most others. */
CDBM_INLINE uint32_t cdbm_least_lane(uint32_t mask, const int32_t *totals)
{
    uint32_t least = cdbm_lowest(mask);
    for (mask &= mask - 1; mask; mask &= mask - 1) {
        uint32_t lane = cdbm_lowest(mask);
        if (totals[lane] < totals[least]) least = lane;
    }
    return least;
}
