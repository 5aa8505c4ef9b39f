/* ---- Critically damped springs, in closed form: after any steps of time they are what they are after one.
 *
 * Source: D. Holden, "Spring-It-On", 2021; orangeduck/Motion-Matching, spring.h. */

/* The damping of a half-life. */
static inline double cdbo_damping(double halflife_s)
{
    return 2.0 * CDBO_LN2 / halflife_s;
}

/* Numbers and their changes a second some time later: each decays to 0, x = e^(-yt) (x0 + (v0 + x0 y) t). May be written in
 * place. */
static inline void cdbo_decay(size_t n, const double *numbers, const double *speeds, double y, double dt_s, double *to_numbers,
    double *to_speeds)
{
    double fade = cdbo_exp(-y * dt_s);
    size_t i;
    for (i = 0; i < n; i++) {
        double number = numbers[i], speed = speeds[i], pushed = speed + number * y;
        to_numbers[i] = fade * (number + pushed * dt_s);
        to_speeds[i] = fade * (speed - pushed * y * dt_s);
    }
}

/* A number that comes to a goal, and its change a second, which follows it. */
static inline void cdbo_come(double *number, double goal, double y, double dt_s)
{
    double apart = number[0] - goal;
    cdbo_decay(1, &apart, &number[1], y, dt_s, &apart, &number[1]);
    number[0] = goal + apart;
}
