/* ---- Stages of a pose, as values: each is a record with its columns, its settings and its function; a pipeline is a list of them.
 *
 *     clip - spring - root - alignment - ground - feet - placing
 *
 * Between two updates a character is a row of numbers, [N, width] for many. A stage writes its own columns of the new row from
 * the old one, and may read those of stages before it; nothing is changed in place, so that old rows stay good for a rollback. */

typedef enum cdbo_pose_column { /* in the order of the stages; three after a name are x, z and heading, or x, y and z */
    CDBO_BEGUN,        /* clip: whether anything was displayed */
    CDBO_TIME,         /* the seconds of the clip that were */
    CDBO_PLAY_RATE,    /* its seconds in a second of play, as it was displayed */
    CDBO_CLIP_RATE,    /* the same, as it is to be until the next update */
    CDBO_CLIP_ROOT,    /* where the clip has the body */
    CDBO_ROTATIONS,    /* the clip's pose: of each joint */
    CDBO_POSITIONS,    /* and of each joint with a position of its own */
    CDBO_FADE,         /* spring: the damping since the last seam, 0 for that of the settings */
    CDBO_TURNS,        /* what is left of the last seams, turns of joints, and their change a second */
    CDBO_SPINS,
    CDBO_SHIFTS,       /* shifts of joints with positions of their own, and their change a second */
    CDBO_SPEEDS,
    CDBO_MODE,         /* root: by what it was moved, one more than a cdbo_root; 0: by nothing yet */
    CDBO_HAS_BODY,     /* where the game has the body, and how fast it moves that */
    CDBO_BODY,
    CDBO_HAS_VELOCITY,
    CDBO_VELOCITY,
    CDBO_BASE,         /* the root without its offset, the offset, and its change a second */
    CDBO_OFFSET,
    CDBO_OFFSET_SPEED,
    CDBO_TURN,         /* alignment: hips and legs turned against the root, steps so many times as long; and the changes */
    CDBO_STRIDE,
    CDBO_HIPS,         /* ground: how high hips are over their clip's, and the change */
    CDBO_FOOTINGS,     /* what is below each foot */
    CDBO_LOWER,        /* feet: how much lower than that legs need the hips, and the change */
    CDBO_FEET,         /* of each foot what feet.h says */
    CDBO_N_COLUMNS
} cdbo_pose_column;

typedef enum cdbo_pose_setting {
    CDBO_BLEND, CDBO_HALFLIFE, CDBO_ROOT, CDBO_POSITION_WEIGHT, CDBO_ROTATION_WEIGHT, CDBO_POSITION_PULL, CDBO_ROTATION_PULL,
    CDBO_POSITION_CLAMP, CDBO_ROTATION_CLAMP, CDBO_PATH_ALIGNMENT, CDBO_ALIGNMENT_LIMIT, CDBO_ALIGNMENT_HALFLIFE, CDBO_MIN_STRIDE,
    CDBO_MAX_STRIDE, CDBO_FOOT_LOCK, CDBO_FOOT_HALFLIFE, CDBO_FOOT_RADIUS, CDBO_N_SETTINGS
} cdbo_pose_setting;

typedef enum cdbo_blend { CDBO_BY_SPRING, CDBO_NO_BLEND } cdbo_blend; /* numbers of the words of "blend" */
typedef enum cdbo_root { CDBO_BY_ANIMATION, CDBO_BY_CODE, CDBO_BY_BOTH, CDBO_BY_PATH } cdbo_root; /* and of "root" */
typedef enum cdbo_action { CDBO_CONTINUES, CDBO_HOLDS, CDBO_DOES_ELSE } cdbo_action; /* what an update did */

typedef enum cdbo_each { CDBO_ONE, CDBO_EACH_JOINT, CDBO_EACH_MOVING, CDBO_EACH_FOOT } cdbo_each;

typedef struct cdbo_column_record {
    cdbo_pose_column column;
    const char *name;
    cdbo_each each;
    size_t width;
    double first; /* of each so many numbers the first, before anything is displayed; the others are 0 */
} cdbo_column_record;

typedef enum cdbo_unit { CDBO_AS_IT_IS, CDBO_DAMPING, CDBO_RADIANS } cdbo_unit; /* half-lives become dampings, degrees radians */

typedef struct cdbo_setting_record {
    cdbo_pose_setting setting;
    const char *name;
    cdbo_unit unit;
} cdbo_setting_record;

typedef struct cdbo_posed cdbo_posed;

typedef struct cdbo_stage {
    const char *name;
    const cdbo_column_record *columns;
    size_t n_columns;
    const cdbo_setting_record *settings;
    size_t n_settings;
    int (*is_on)(const double *settings); /* NULL: always */
    void (*run)(cdbo_posed *one);
} cdbo_stage;

#define CDBO_MOST_STAGES 16

/* What the characters of a crowd share. */
typedef struct cdbo_poses {
    cdbo_rig rig;
    const cdbo_frames *const *banks;
    size_t n_banks;
    double settings[CDBO_N_SETTINGS];
    const cdbo_stage *stages[CDBO_MOST_STAGES];
    size_t n_stages, n_before_ground;
    size_t at[CDBO_N_COLUMNS]; /* where each column begins in a row */
    size_t width;             /* of a row */
} cdbo_poses;

/* What happens to a character in an update; all are numbers, as they come in arrays. */
typedef struct cdbo_given {
    double bank, range, at_s;      /* what plays: the number of its bank, below 0 for nothing, its range and second */
    double is_on, action, rate;    /* whether anything played before, a cdbo_action, and how fast it plays */
    double motion[3], weight;      /* how the clip moved the body (left, ahead, turn), and how much of that counts */
    double is_ahead, seam;         /* whether the motion is already that of what is entered; number of the seam, below 0 for none */
    double lost_s;                 /* the seconds that were left when what played had run out: the motion is without them */
    double gives_ground;
    double blend_s, root;          /* as the row of what plays says, NaN for as the settings do: how long a seam is blended; a cdbo_root */
} cdbo_given;

typedef struct cdbo_seam { /* a moment at a seam: two for each, what is left and what is entered */
    double bank, range, at_s, rate;
} cdbo_seam;

/* One character in an update: what it was given, what is written of it, and what the stages hand on. */
struct cdbo_posed {
    const cdbo_poses *poses;
    const cdbo_given *given;
    const double *place;       /* where the game has the body, NULL for nowhere */
    const cdbo_seam *seams;     /* NULL without a seam */
    const double *below;       /* [F, 3]: the ground at the points that were asked for; NULL where it is level */
    const double *before;
    double dt_s, mode;         /* mode: the cdbo_root of this update */
    double *row, *root, *rotations, *translations, *positions; /* [width], [3], [J, 4], [J, 3], [J, 3] */
    unsigned char *contacts;   /* [F] */
    const cdbo_frames *frames;  /* of what plays, NULL for nothing */
    size_t frame;              /* the nearest */
    double travel[3];          /* how fast what plays goes to the left and ahead of its mean facing, and its turn from that */
    cdbo_vector left, entered;  /* at a seam, the velocities of the roots in the body's own frame */
    double *world, *free;      /* [J, 4], and [F, 3]: where feet are without a lock */
    double *seam_poses;        /* room for two poses and their changes */
    int bends, is_flat;        /* whether legs may have to bend; whether no ground is felt */
};

static inline double *cdbo_column(const cdbo_posed *one, cdbo_pose_column column)
{
    return one->row + one->poses->at[column];
}

static inline const double *cdbo_was(const cdbo_posed *one, cdbo_pose_column column)
{
    return one->before + one->poses->at[column];
}

static inline double cdbo_set(const cdbo_posed *one, cdbo_pose_setting setting)
{
    return one->poses->settings[setting];
}

/* So many numbers of the old row go into the new one. */
static inline void cdbo_keep(const cdbo_posed *one, cdbo_pose_column column, size_t n)
{
    memcpy(cdbo_column(one, column), cdbo_was(one, column), n * sizeof(double));
}

#define CDBO_COUNT(list) (sizeof(list) / sizeof *(list))
