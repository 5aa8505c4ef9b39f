/* ---- Footings: the ground below feet, as a pose feels it. A foot that is down stands on the ground below it, as steep as that is;
 * one that is up goes from the ground that it left to that where its clip puts it down: up in the first half of its swing, down in
 * the second. All comes there as critically damped springs do, so that a step of the ground is none of the body.
 *
 * The ground is three numbers: its height, and by how much it rises along x and z. A footing is nine: the ground below the foot
 * now, its change a second, and the ground where the foot stood last. */

#define CDBO_FOOTING 9

/* From 0 to 1 without a step in the change: 3 s^2 - 2 s^3. */
static inline double cdbo_eased(double share)
{
    share = cdbo_within(share, 0.0, 1.0);
    return share * share * (3.0 - 2.0 * share);
}

/* A foot that was put elsewhere: it stands there at once. */
static inline void cdbo_new_footing(double *footing, const double *here)
{
    size_t i;
    for (i = 0; i < 3; i++) footing[i] = footing[6 + i] = here[i], footing[3 + i] = 0.0;
}

/* A footing some time later; `share` of the swing is gone, below 0 of a foot that is down, and `there` is the ground that it
 * goes to. Gives the height that the hips go by. */
static inline double cdbo_feel(double *footing, const double *there, double share, double dt_s)
{
    double y = cdbo_damping(CDBO_HIPS_HALFLIFE_S), goal[3], apart[3];
    const double *last = footing + 6;
    int is_down = share < 0.0;
    size_t i;
    for (i = 0; i < 3; i++) {
        double part = i > 0 ? cdbo_eased(share) : there[0] > last[0] ? cdbo_eased(2.0 * share) : cdbo_eased(2.0 * share - 1.0);
        goal[i] = is_down ? there[i] : last[i] + part * (there[i] - last[i]);
        apart[i] = footing[i] - goal[i];
    }
    cdbo_decay(3, apart, footing + 3, y, dt_s, apart, footing + 3);
    for (i = 0; i < 3; i++) {
        footing[i] = goal[i] + apart[i];
        if (is_down) footing[6 + i] = there[i];
    }
    return is_down ? there[0] : last[0] + cdbo_eased(share) * (there[0] - last[0]);
}
