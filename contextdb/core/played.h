/* ---- What plays, as facts for the tables of a character; contextdb/motion/characters/played.py names them.
 *
 * A clip is n frames, at `rate` a second, and is played at second `at_s`. */

#define CDBM_MOST_UNTIL_S 10.0 /* the greatest number of seconds until a foot is down */
#define CDBM_GOING_S 1.0       /* speed and turn are means over so much of the clip, as a body sways with its steps */

/* Seconds until a foot is down, 0 while it is, by the contacts of all feet [n, n_feet]; the most where it never is, or not before the
 * clip ends. */
static inline double cdbm_until_down_s(const uint8_t *contacts, size_t n, size_t n_feet, size_t foot, int is_looping, double rate, double at_s)
{
    double nearest = floor(at_s * rate + 0.5);
    size_t first = !(nearest > 0.0) ? 0 : nearest < (double)(n - 1) ? (size_t)nearest : n - 1, last = is_looping ? first + n : n, i;
    for (i = first; foot < n_feet && i < last; i++)
        if (contacts[i % n * n_feet + foot]) return cdbo_least((double)(i - first) / rate, CDBM_MOST_UNTIL_S);
    return CDBM_MOST_UNTIL_S;
}

/* How fast a clip goes, m/s, and turns, degrees a second, about now, by its path [n, 3]. */
static inline void cdbm_going(const float *path, size_t n, double rate, double at_s, double *speed, double *turn)
{
    double now = at_s * rate, half = CDBM_GOING_S * rate / 2.0, motion[3], seconds;
    double first = cdbo_most(now - half, 0.0), last = cdbo_least(now + half, (double)(n - 1));
    *speed = *turn = 0.0;
    if (!(last > first)) return;
    cdbm_motion_between(path, n, first, last, motion);
    seconds = (last - first) / rate;
    *speed = cdbo_flat_length(motion[0], motion[1]) / seconds, *turn = motion[2] * (180.0 / CDBO_PI) / seconds;
}

/* The share of a clip that has played. */
static inline double cdbm_phase(size_t n, double rate, double at_s)
{
    return cdbo_within(at_s / ((double)(n > 2 ? n - 1 : 1) / rate), 0.0, 1.0);
}
