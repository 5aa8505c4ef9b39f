/* ---- Functions of numbers that differ between the libraries of systems, written once: sine, cosine, arctangent, arccosine, the
 * exponential and the logarithm, each within 2.5 in the last place, and remainders, which are exact.
 *
 * Source: the polynomials and the reduction of angles are those of fdlibm (Sun Microsystems, 1993), as in FreeBSD's msun:
 * k_sin.c, k_cos.c, e_rem_pio2.c, e_exp.c, e_log.c; the reduction follows Cody and Waite, "Software Manual for the Elementary
 * Functions", 1980. The arctangent is that of arithmetic.h. */

#define CDBO_PI 3.14159265358979311600
#define CDBO_TAU 6.28318530717958623200
#define CDBO_LN2 0.69314718055994528623
#define CDBO_FARTHEST_ANGLE 1e6 /* radians, up to which angles are reduced by all digits of pi */

/* The first number, or the other one where that is less, or more. A NaN stays where it is first. */
static inline double cdbo_least(double a, double b)
{
    return b < a ? b : a;
}

static inline double cdbo_most(double a, double b)
{
    return b > a ? b : a;
}

static inline double cdbo_within(double number, double least, double most)
{
    return cdbo_least(cdbo_most(number, least), most);
}

static inline double cdbo_size(double number)
{
    return number < 0.0 ? -number : number;
}

/* The size of one number with the sign of another. */
static inline double cdbo_signed(double size, double sign)
{
    return sign < 0.0 ? -size : size;
}

/* What is left of a number from 0 when a step above 0 is taken off as often as it goes: exact, as each difference is of numbers of
 * which neither is more than twice the other. NaN for what is not finite. */
static inline double cdbo_rest(double number, double step)
{
    double part = step;
    if (!(number <= DBL_MAX / 2.0)) return NAN;
    while (part <= 0.5 * number) part *= 2.0;
    for (; part >= step; part *= 0.5)
        if (number >= part) number -= part;
    return number;
}

/* The angle that is the same and at most half a turn. */
static inline double cdbo_remainder(double angle)
{
    double rest = cdbo_rest(cdbo_size(angle), CDBO_TAU);
    if (rest > CDBO_PI) rest -= CDBO_TAU;
    return angle < 0.0 ? -rest : rest;
}

/* Sine and cosine of an angle. */
static inline void cdbo_sin_cos(double angle, double *sine, double *cosine)
{
    double turns, near, apart, x, y, z, zz, product, high, s, c;
    int64_t quarter;
    if (!(cdbo_size(angle) <= CDBO_FARTHEST_ANGLE)) angle = cdbo_remainder(angle);
    if (!(cdbo_size(angle) <= CDBO_FARTHEST_ANGLE)) {
        *sine = *cosine = NAN;
        return;
    }
    quarter = (int64_t)(angle * 6.36619772367581382433e-01 + (angle < 0.0 ? -0.5 : 0.5));
    turns = (double)quarter;
    apart = angle - turns * 1.57079632673412561417e+00; /* 33 bits of a quarter turn, then 33 more, then the others */
    product = turns * 6.07710050630396597660e-11;
    near = apart - product;
    product = turns * 2.02226624879595063154e-21 - ((apart - near) - product);
    x = near - product;
    y = (near - x) - product;
    z = x * x;
    zz = z * z;
    s = 8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + z * (2.75573137070700676789e-06 +
        z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)));
    s = x - ((z * (0.5 * y - z * x * s) - y) - z * x * -1.66666666666666324348e-01);
    c = z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * 2.48015872894767294178e-05)) +
        zz * zz * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11));
    high = 1.0 - 0.5 * z;
    c = high + (((1.0 - high) - 0.5 * z) + (z * c - x * y));
    switch (quarter & 3) {
    case 0: *sine = s, *cosine = c; break;
    case 1: *sine = c, *cosine = -s; break;
    case 2: *sine = -s, *cosine = -c; break;
    default: *sine = -c, *cosine = s; break;
    }
}

/* The angle of (x, y) from the x axis, -pi to pi; 0 of no direction. */
static inline double cdbo_atan2(double y, double x)
{
    return cdbi_direction(y, x, 0.25 * CDBO_PI, 1.0);
}

/* The angle of a cosine from -1 to 1. */
static inline double cdbo_acos(double cosine)
{
    return cdbo_atan2(sqrt((1.0 - cosine) * (1.0 + cosine)), cosine);
}

/* 2 to a whole power that a double has without losing digits. */
static inline double cdbo_power_of_2(int power)
{
    uint64_t bits = (uint64_t)(1023 + power) << 52;
    double number;
    memcpy(&number, &bits, sizeof number);
    return number;
}

/* e to the power of a number. */
static inline double cdbo_exp(double x)
{
    double high, low, r, z, c;
    int power;
    if (!(x < 709.782712893383973096)) return x > 0.0 ? HUGE_VAL : x;
    if (x < -745.13321910194110842) return 0.0;
    power = (int)(x * 1.44269504088896338700e+00 + (x < 0.0 ? -0.5 : 0.5));
    high = x - power * 6.93147180369123816490e-01;
    low = power * 1.90821492927058770002e-10;
    r = high - low;
    z = r * r;
    c = r - z * (1.66666666666666019037e-01 + z * (-2.77777777770155933842e-03 + z * (6.61375632143793436117e-05 +
        z * (-1.65339022054652515390e-06 + z * 4.13813679705723846039e-08))));
    r = 1.0 - ((low - (r * c) / (2.0 - c)) - high);
    if (power < -1000) return r * cdbo_power_of_2(power + 100) * cdbo_power_of_2(-100);
    return power > 1000 ? r * cdbo_power_of_2(power - 100) * cdbo_power_of_2(100) : r * cdbo_power_of_2(power);
}

/* The natural logarithm of a number that is above 0 and has all its digits. */
static inline double cdbo_log(double x)
{
    uint64_t bits = cdbi_bits(x), digits = bits & 0xFFFFFFFFFFFFF, over = (digits + 0x95F64ULL * 0x100000000) & 0x10000000000000;
    double f = cdbi_double(digits | (over ^ 0x3FF0000000000000)) - 1.0, s = f / (2.0 + f), z = s * s, w = z * z, half = 0.5 * f * f, sum;
    double power = (double)((int)(bits >> 52) - 1023 + (int)(over >> 52));
    sum = z * (6.666666666666735130e-01 + w * (2.857142874366239149e-01 + w * (1.818357216161805012e-01 +
        w * 1.479819860511658591e-01))) + w * (3.999999999940941908e-01 + w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01));
    return power * 6.93147180369123816490e-01 - ((half - (s * (half + sum) + power * 1.90821492927058770002e-10)) - f);
}
