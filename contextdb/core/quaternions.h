/* ---- Rotations: unit quaternions (w, x, y, z), and turns: an axis times an angle in radians.
 *
 * Source: J. Sola and others, "A micro Lie theory for state estimation in robotics", 2018 (the Jacobian of a rotation vector). */

typedef struct cdbo_vector {
    double x, y, z;
} cdbo_vector;

typedef struct cdbo_quaternion {
    double w, x, y, z;
} cdbo_quaternion;

static inline cdbo_vector cdbo_xyz(double x, double y, double z)
{
    cdbo_vector made;
    made.x = x, made.y = y, made.z = z;
    return made;
}

static inline cdbo_quaternion cdbo_wxyz(double w, double x, double y, double z)
{
    cdbo_quaternion made;
    made.w = w, made.x = x, made.y = y, made.z = z;
    return made;
}

/* Row j of an array [n, 3] or [n, 4], and the same written. */
static inline cdbo_vector cdbo_get3(const double *rows, size_t j)
{
    return cdbo_xyz(rows[3 * j], rows[3 * j + 1], rows[3 * j + 2]);
}

static inline cdbo_quaternion cdbo_get4(const double *rows, size_t j)
{
    return cdbo_wxyz(rows[4 * j], rows[4 * j + 1], rows[4 * j + 2], rows[4 * j + 3]);
}

static inline void cdbo_set3(double *rows, size_t j, cdbo_vector v)
{
    rows[3 * j] = v.x, rows[3 * j + 1] = v.y, rows[3 * j + 2] = v.z;
}

static inline void cdbo_set4(double *rows, size_t j, cdbo_quaternion q)
{
    rows[4 * j] = q.w, rows[4 * j + 1] = q.x, rows[4 * j + 2] = q.y, rows[4 * j + 3] = q.z;
}

static inline cdbo_vector cdbo_add(cdbo_vector a, cdbo_vector b)
{
    return cdbo_xyz(a.x + b.x, a.y + b.y, a.z + b.z);
}

static inline cdbo_vector cdbo_from(cdbo_vector a, cdbo_vector b)
{
    return cdbo_xyz(b.x - a.x, b.y - a.y, b.z - a.z);
}

static inline cdbo_vector cdbo_times(double share, cdbo_vector v)
{
    return cdbo_xyz(share * v.x, share * v.y, share * v.z);
}

static inline double cdbo_dot(cdbo_vector a, cdbo_vector b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline double cdbo_length(cdbo_vector v)
{
    return sqrt(cdbo_dot(v, v));
}

static inline double cdbo_flat_length(double x, double z)
{
    return sqrt(x * x + z * z);
}

static inline cdbo_vector cdbo_cross(cdbo_vector a, cdbo_vector b)
{
    return cdbo_xyz(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

/* The rotation of b, then of a. */
static inline cdbo_quaternion cdbo_then(cdbo_quaternion a, cdbo_quaternion b)
{
    return cdbo_wxyz(a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
        a.w * b.y + a.y * b.w + a.z * b.x - a.x * b.z, a.w * b.z + a.z * b.w + a.x * b.y - a.y * b.x);
}

/* The rotation back. */
static inline cdbo_quaternion cdbo_back(cdbo_quaternion a)
{
    return cdbo_wxyz(a.w, -a.x, -a.y, -a.z);
}

/* A vector turned by a rotation. */
static inline cdbo_vector cdbo_rotated(cdbo_quaternion q, cdbo_vector v)
{
    cdbo_vector axis = cdbo_xyz(q.x, q.y, q.z), t = cdbo_times(2.0, cdbo_cross(axis, v)), u = cdbo_cross(axis, t);
    return cdbo_xyz(v.x + q.w * t.x + u.x, v.y + q.w * t.y + u.y, v.z + q.w * t.z + u.z);
}

/* The rotation about a unit axis by an angle. */
static inline cdbo_quaternion cdbo_about(cdbo_vector axis, double angle)
{
    double sine, cosine;
    cdbo_sin_cos(0.5 * angle, &sine, &cosine);
    return cdbo_wxyz(cosine, sine * axis.x, sine * axis.y, sine * axis.z);
}

/* The rotation about the vertical. */
static inline cdbo_quaternion cdbo_heading(double angle)
{
    return cdbo_about(cdbo_xyz(0.0, 1.0, 0.0), angle);
}

/* The rotation of a turn. */
static inline cdbo_quaternion cdbo_rotation(cdbo_vector turn)
{
    double angle = cdbo_length(turn), sine, cosine, share;
    cdbo_sin_cos(0.5 * angle, &sine, &cosine);
    share = angle > 1e-9 ? sine / angle : 0.5;
    return cdbo_wxyz(cosine, share * turn.x, share * turn.y, share * turn.z);
}

/* The turn of a rotation, the shorter way round: at most pi long. */
static inline cdbo_vector cdbo_turn(cdbo_quaternion q)
{
    double sign = q.w < 0.0 ? -1.0 : 1.0, sine = sqrt(q.x * q.x + q.y * q.y + q.z * q.z);
    double share = sign * (sine > 1e-12 ? 2.0 * cdbo_atan2(sine, cdbo_size(q.w)) / sine : 2.0);
    return cdbo_xyz(share * q.x, share * q.y, share * q.z);
}

/* How fast a rotation spins, in the outer frame, while its turn changes at a speed. */
static inline cdbo_vector cdbo_spin_of(cdbo_vector turn, cdbo_vector speed)
{
    double a = cdbo_length(turn), sine, cosine, first = 0.5, second = 1.0 / 6.0;
    cdbo_vector one = cdbo_cross(turn, speed), two = cdbo_cross(turn, one);
    if (!(a < 1e-4)) {
        cdbo_sin_cos(a, &sine, &cosine);
        first = (1.0 - cosine) / (a * a);
        second = (a - sine) / (a * a * a);
    }
    return cdbo_xyz(speed.x + first * one.x + second * two.x, speed.y + first * one.y + second * two.y,
        speed.z + first * one.z + second * two.z);
}

/* The inverse of cdbo_spin_of: how fast the turn changes while the rotation spins; of angles up to pi. */
static inline cdbo_vector cdbo_speed_of(cdbo_vector turn, cdbo_vector spin)
{
    double a = cdbo_length(turn), sine, cosine, second = 1.0 / 12.0;
    cdbo_vector one = cdbo_cross(turn, spin), two = cdbo_cross(turn, one);
    if (!(a < 1e-3)) {
        cdbo_sin_cos(0.5 * a, &sine, &cosine);
        second = (1.0 - 0.5 * a * cosine / sine) / (a * a);
    }
    return cdbo_xyz(spin.x - 0.5 * one.x + second * two.x, spin.y - 0.5 * one.y + second * two.y,
        spin.z - 0.5 * one.z + second * two.z);
}

/* The shortest rotation of one direction to another; none for directions without length, or opposite ones. */
static inline cdbo_quaternion cdbo_arc(cdbo_vector u, cdbo_vector v)
{
    double size = cdbo_length(u) * cdbo_length(v), w = size + u.x * v.x + u.y * v.y + u.z * v.z, n;
    cdbo_vector c = cdbo_cross(u, v);
    if (size < 1e-12 || w < 1e-9 * size) return cdbo_wxyz(1.0, 0.0, 0.0, 0.0);
    n = sqrt(w * w + c.x * c.x + c.y * c.y + c.z * c.z);
    return cdbo_wxyz(w / n, c.x / n, c.y / n, c.z / n);
}
