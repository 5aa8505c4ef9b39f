
/* ---- Doubles, as Python computes with them: each step is rounded by itself, whatever a compiler may join or reorder, and what is
 * NaN, infinite or 0 is known by its bits, since options such as -ffast-math take comparisons away. */

static inline uint64_t cdbi_bits(double number)
{
    uint64_t bits;
    memcpy(&bits, &number, sizeof bits);
    return bits;
}

static inline double cdbi_double(uint64_t bits)
{
    double number;
    memcpy(&number, &bits, sizeof number);
    return number;
}

CDB_API double cdb_missing_number(void)
{
    return cdbi_double(0x7FF8000000000000);
}

static inline int cdbi_is_nan(double number)
{
    return (cdbi_bits(number) & 0x7FFFFFFFFFFFFFFF) > 0x7FF0000000000000;
}

static inline int cdbi_is_infinite(double number)
{
    return (cdbi_bits(number) & 0x7FFFFFFFFFFFFFFF) == 0x7FF0000000000000;
}

/* A whole number for each double, in their order. Compared as doubles, tiny ones would be 0 to a machine that was told to flush. */
#define CDBI_MINUS_ZERO 0x7FFFFFFFFFFFFFFFU

static inline uint64_t cdbi_place(double number)
{
    uint64_t bits = cdbi_bits(number);
    return bits >> 63 ? ~bits : bits | 0x8000000000000000U;
}

static inline double cdbi_without_sign(double number)
{
    return cdbi_double(cdbi_bits(number) & 0x7FFFFFFFFFFFFFFF);
}

static inline double cdbi_negative(double number)
{
    return cdbi_double(cdbi_bits(number) ^ 0x8000000000000000);
}

static inline int cdbi_is_zero(double number)
{
    return (cdbi_bits(number) & 0x7FFFFFFFFFFFFFFF) == 0;
}

static inline int cdbi_is_below_zero(double number)
{
    return cdbi_bits(number) >> 63 && !cdbi_is_zero(number);
}

/* 0 for -0. */
static inline double cdbi_plain(double number)
{
    return cdbi_is_zero(number) ? 0.0 : number;
}

/* NaN, a missing number, for what is not finite. */
static inline double cdbi_settled(double number)
{
    return cdbi_is_nan(number) || cdbi_is_infinite(number) ? cdb_missing_number() : cdbi_plain(number);
}

static inline double cdbi_sum(double a, double b)
{
    volatile double one = a, other = b, result;
    result = one + other;
    return result;
}

static inline double cdbi_product(double a, double b)
{
    volatile double one = a, other = b, result;
    result = one * other;
    return result;
}

static inline double cdbi_ratio(double a, double b)
{
    volatile double one = a, other = b, result;
    if (cdbi_is_zero(b)) return cdb_missing_number();
    result = one / other;
    return result;
}

/* a + b * c in two steps. */
static inline double cdbi_with_product(double a, double b, double c)
{
    return cdbi_sum(a, cdbi_product(b, c));
}

/* The whole number at or below. */
static inline double cdbi_floor(double number)
{
    uint64_t bits = cdbi_bits(number), fraction;
    int exponent = (int)(bits >> 52 & 0x7FF) - 1023;
    if (exponent >= 52) return number;
    if (exponent < 0) return cdbi_is_below_zero(number) ? -1.0 : 0.0;
    fraction = ((uint64_t)1 << (52 - exponent)) - 1;
    if ((bits & fraction) == 0) return number;
    if (bits >> 63) bits += fraction;
    return cdbi_double(bits & ~fraction);
}

/* The nearest whole number, of two the even one. */
static inline double cdbi_round(double number)
{
    double size = cdbi_without_sign(number), whole = cdbi_floor(size);
    uint64_t rest;
    if (cdbi_place(size) >= cdbi_place(4503599627370496.0)) return number;
    rest = cdbi_place(cdbi_sum(size, cdbi_negative(whole)));
    if (rest > cdbi_place(0.5) || (rest == cdbi_place(0.5) && ((uint64_t)whole & 1))) whole = cdbi_sum(whole, 1.0);
    return cdbi_bits(number) >> 63 ? cdbi_negative(whole) : whole;
}

/* The root, digit by digit: no library is needed, and each is rounded right. NaN below 0. */
static inline double cdbi_root(double number)
{
    uint64_t bits = cdbi_bits(number), root = 0, rest = 0, digits = bits & 0xFFFFFFFFFFFFF;
    int exponent = (int)(bits >> 52 & 0x7FF), i;
    if (cdbi_is_zero(number)) return 0.0;
    if (bits >> 63 || exponent == 0x7FF) return bits == 0x7FF0000000000000 ? number : cdb_missing_number();
    if (exponent > 0) digits |= (uint64_t)1 << 52;
    else exponent = 1;
    for (; digits >> 52 == 0; exponent--) digits <<= 1;
    exponent -= 1075; /* the number is digits * 2 ** exponent */
    if (exponent % 2 != 0) {
        digits <<= 1;
        exponent--;
    }
    for (i = 0; i < 54; i++) {
        rest = rest << 2 | (i < 27 ? digits >> (52 - 2 * i) & 3 : 0);
        root <<= 1;
        if (rest > 2 * root) {
            rest -= 2 * root + 1;
            root++;
        }
    }
    root = (root >> 1) + (root & 1); /* half is never met: the square of an odd number is odd */
    return cdbi_double(((uint64_t)(exponent / 2 - 26 + 1075) << 52) + root - ((uint64_t)1 << 52));
}

/* What is left of a after whole steps of b, towards 0 and exact; b is not 0. */
static inline double cdbi_rest(double a, double b)
{
    uint64_t x = cdbi_bits(a) & 0x7FFFFFFFFFFFFFFF, y = cdbi_bits(b) & 0x7FFFFFFFFFFFFFFF, sign = cdbi_bits(a) ^ x;
    int of_x = (int)(x >> 52), of_y = (int)(y >> 52);
    if (x >= 0x7FF0000000000000 || y > 0x7FF0000000000000 || y == 0) return cdb_missing_number();
    if (x < y) return a;
    x &= 0xFFFFFFFFFFFFF;
    y &= 0xFFFFFFFFFFFFF;
    if (of_x > 0) x |= (uint64_t)1 << 52;
    else for (of_x = 1; x >> 52 == 0; of_x--) x <<= 1;
    if (of_y > 0) y |= (uint64_t)1 << 52;
    else for (of_y = 1; y >> 52 == 0; of_y--) y <<= 1;
    for (; of_x > of_y; of_x--) {
        if (x >= y) x -= y;
        x <<= 1;
    }
    if (x >= y) x -= y;
    if (x == 0) return cdbi_double(sign);
    for (; x >> 52 == 0; of_x--) x <<= 1;
    return cdbi_double(sign | (of_x > 0 ? (uint64_t)of_x << 52 | (x & 0xFFFFFFFFFFFFF) : x >> (1 - of_x)));
}

/* a % b with the sign of b. */
static inline double cdbi_remainder(double a, double b)
{
    double rest;
    if (cdbi_is_zero(b)) return cdb_missing_number();
    rest = cdbi_rest(a, b);
    if (cdbi_is_zero(rest)) return 0.0;
    return cdbi_is_below_zero(rest) != cdbi_is_below_zero(b) ? cdbi_sum(rest, b) : rest;
}

/* a // b, by the steps of Python's own. */
static inline double cdbi_floor_ratio(double a, double b)
{
    double rest, ratio, whole;
    if (cdbi_is_zero(b)) return cdb_missing_number();
    rest = cdbi_rest(a, b);
    ratio = cdbi_ratio(cdbi_sum(a, cdbi_negative(rest)), b);
    if (!cdbi_is_zero(rest) && cdbi_is_below_zero(rest) != cdbi_is_below_zero(b)) ratio = cdbi_sum(ratio, -1.0);
    if (cdbi_is_nan(ratio) || cdbi_is_zero(ratio)) return ratio;
    whole = cdbi_floor(ratio);
    return cdbi_place(cdbi_sum(ratio, cdbi_negative(whole))) > cdbi_place(0.5) ? cdbi_sum(whole, 1.0) : whole;
}

static inline double cdbi_power(double base, int32_t exponent)
{
    double result = 1.0;
    if (cdbi_is_nan(base) || cdbi_is_infinite(base)) return cdb_missing_number();
    for (; exponent > 0; exponent /= 2) {
        if (exponent % 2 != 0) result = cdbi_product(result, base);
        if (exponent > 1) base = cdbi_product(base, base);
    }
    return result;
}

static inline int cdbi_is_less(double a, double b)
{
    return cdbi_place(a) < cdbi_place(b);
}

/* The lesser of two numbers that are not -0, or the greater; missing when one is. */
static inline double cdbi_lowest(double a, double b, int is_highest)
{
    if (cdbi_is_nan(a) || cdbi_is_nan(b)) return cdb_missing_number();
    return cdbi_is_less(b, a) != is_highest ? b : a;
}

/* The length of a vector; scaled by a power of two where squares would overflow or vanish. */
static inline double cdbi_length(double x, double y)
{
    double most = cdbi_lowest(cdbi_without_sign(x), cdbi_without_sign(y), 1), scale = 1.0, a, b;
    if (cdbi_is_nan(most)) return most;
    if (cdbi_is_less(1e150, most)) scale = cdbi_double(0x1A70000000000000);      /* 2 ** -600 */
    else if (cdbi_is_less(most, 1e-150)) scale = cdbi_double(0x6570000000000000); /* 2 ** 600 */
    a = cdbi_product(x, scale);
    b = cdbi_product(y, scale);
    return cdbi_ratio(cdbi_root(cdbi_sum(cdbi_product(a, a), cdbi_product(b, b))), scale);
}

/* The same angle from -180 up to, not including, 180. Exact: each step takes a number from one less than twice as large. */
static inline double cdbi_wrapped(double degrees)
{
    double rest = degrees < 0 ? -degrees : degrees, turn = 360;
    while (turn <= rest / 2) turn *= 2;
    for (; turn >= 360; turn /= 2)
        if (rest >= turn) rest -= turn;
    if (degrees < 0) return rest > 180 ? 360 - rest : -rest;
    return rest >= 180 ? rest - 360 : rest;
}

/* The angle in radians whose tangent is x, from -0.4143 to 0.4143: the sums of contextdb's arithmetic.py, in their order. */
static inline double cdbi_arc(double x)
{
    double z = cdbi_product(x, x), w = cdbi_product(z, z), even, odd;
    even = cdbi_with_product(4.97687799461593236017e-02, w, 1.62858201153657823623e-02);
    even = cdbi_with_product(6.66107313738753120669e-02, w, even);
    even = cdbi_with_product(9.09088713343650656196e-02, w, even);
    even = cdbi_with_product(1.42857142725034663711e-01, w, even);
    even = cdbi_product(z, cdbi_with_product(3.33333333333329318027e-01, w, even));
    odd = cdbi_with_product(-5.83357013379057348645e-02, w, -3.65315727442169155270e-02);
    odd = cdbi_with_product(-7.69187620504482999495e-02, w, odd);
    odd = cdbi_with_product(-1.11111104054623557880e-01, w, odd);
    odd = cdbi_product(w, cdbi_with_product(-1.99999999998764832476e-01, w, odd));
    return cdbi_sum(x, cdbi_negative(cdbi_product(x, cdbi_sum(even, odd))));
}

/* The direction of the vector (x, y), from minus half a turn to half a turn, in a unit that is so many radians; `eighth` is an eighth
 * of a turn. 0 for the vector without length. */
static inline double cdbi_direction(double y, double x, double eighth, double unit)
{
    double wide = cdbi_without_sign(x), high = cdbi_without_sign(y), ratio, angle;
    int is_steep = cdbi_is_less(wide, high);
    if (cdbi_is_nan(x) || cdbi_is_nan(y)) return cdb_missing_number();
    if (cdbi_is_zero(wide) && cdbi_is_zero(high)) return 0.0;
    ratio = is_steep ? cdbi_ratio(wide, high) : cdbi_ratio(high, wide);
    if (cdbi_is_nan(ratio)) return ratio;
    if (cdbi_is_less(0.41421356237309503, ratio))
        angle = cdbi_with_product(eighth, cdbi_arc(cdbi_ratio(cdbi_sum(ratio, -1.0), cdbi_sum(ratio, 1.0))), unit);
    else angle = cdbi_product(cdbi_arc(ratio), unit);
    if (is_steep) angle = cdbi_sum(2.0 * eighth, cdbi_negative(angle));
    if (cdbi_is_below_zero(x)) angle = cdbi_sum(4.0 * eighth, cdbi_negative(angle));
    return cdbi_is_below_zero(y) ? cdbi_negative(angle) : angle;
}

/* The same in degrees, from -180 up to, not including, 180. */
static inline double cdbi_heading(double y, double x)
{
    return cdbi_wrapped(cdbi_direction(y, x, 45.0, 57.29577951308232));
}
