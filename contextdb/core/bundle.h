/* ---- A bundle: all that the characters of a game need of its motion, in one file that is mapped into memory and read where it is.
 *
 *   64 bytes        "CDBMOTN2", the size of the file, a digest of all behind it, the number of parts, 0
 *   24 bytes a part its kind, a number (which database, bank, controller or table), where it begins, how many bytes it is
 *   the parts       each begins on a multiple of 64
 *
 * All numbers are little-endian. Whatever is read by number is checked when it is opened: a damaged bundle is refused, or plays
 * something else, and never reads outside of itself. */

#define CDBM_MAGIC "CDBMOTN2"

enum {  /* kinds of parts; of a database, of a bank, of a controller, of a table */
    CDBM_P_BLOCKS = 1, CDBM_P_ORDER, CDBM_P_RANK, CDBM_P_BOX_STARTS, CDBM_P_BOX_SIZES, CDBM_P_BOX_RANGES, CDBM_P_BOX_KINDS,
    CDBM_P_RANGE_BOXES, CDBM_P_KINDS, CDBM_P_OFFSET, CDBM_P_SCALE, CDBM_P_CHANNELS, CDBM_P_WEIGHTS, CDBM_P_ROOTS, CDBM_P_STARTS,
    CDBM_P_STOPS, CDBM_P_ASSET_RANGES, CDBM_P_LOOPING, CDBM_P_ROOT, CDBM_P_MARKS, CDBM_P_ROOT_WEIGHTS, CDBM_P_DATABASE, CDBM_P_POSE_RANGES, CDBM_P_ASSETS,
    CDBM_P_MIRRORED, CDBM_P_ROW_STARTS, CDBM_P_ROWS, CDBM_P_NAME, CDBM_P_LEVEL_STEP, CDBM_P_LEVELS,
    CDBM_P_EVENT_NAMES = 34, CDBM_P_EVENT_STARTS, CDBM_P_EVENT_FRAMES, CDBM_P_WARPS, CDBM_P_ENDS,
    CDBM_P_ASSET_KEYS, CDBM_P_FACT_TAGS,
    CDBM_P_POSE_ROTATIONS = 44, CDBM_P_POSE_POSITIONS, CDBM_P_POSE_ROOT, CDBM_P_POSE_WAYS, CDBM_P_POSE_CONTACTS, CDBM_P_POSE_STEPS,
    CDBM_P_POSE_STARTS, CDBM_P_POSE_N_STEPS, CDBM_P_POSE_LOOPING, CDBM_P_POSE_RATE,
    CDBM_P_ENTRIES = 60, CDBM_P_SETTINGS, CDBM_P_THRESHOLDS, CDBM_P_BARS, CDBM_P_RANGE_BIASES, CDBM_P_ALLOWED, CDBM_P_PLAYABLE,
    CDBM_P_KIND_BIASES, CDBM_P_STEPS, CDBM_P_FEATURES, CDBM_P_VELOCITIES, CDBM_P_OUTPUT, CDBM_P_PARENTS, CDBM_P_OFFSETS, CDBM_P_PLACES,
    CDBM_P_LEGS, CDBM_P_HINGES, CDBM_P_TOPS, CDBM_P_SPINE, CDBM_P_LEFT, CDBM_P_JOINTS, CDBM_P_CONTROLLER_NAME, CDBM_P_JOINT_NAMES,
    CDBM_P_TABLE = 90, CDBM_P_TABLE_NAME, CDBM_P_OWN_FACTS, CDBM_P_MIRROR,
    CDBM_P_TAGS = 110, CDBM_P_KIND_TAGS,
    CDBM_P_MORE = 120,              /* of a controller: databases that its characters have poses of, as its entries; it does not search them */
    CDBM_P_ROLES = 130, CDBM_P_ROLE_RANGES, CDBM_P_JOINT_BOXES, CDBM_P_JOINT_RANGES, CDBM_P_JOINT_FIRSTS, CDBM_P_JOINT_LOWS, CDBM_P_JOINT_HIGHS,
    CDBM_P_SEEN, CDBM_P_SEEN_LOWS, CDBM_P_SEEN_HIGHS, CDBM_P_PAIRS, CDBM_P_JOINT_WEIGHTS, CDBM_P_SEEN_WEIGHTS, CDBM_P_JOINT_BIASES,
    CDBM_P_JOINT_KIND_BIASES, CDBM_P_JOINT_ALLOWED, CDBM_P_JOINT_WARPS, CDBM_P_JOINT_MIRRORED, CDBM_P_JOINT_ROW_STARTS, CDBM_P_JOINT_ROWS,
    CDBM_P_SET = 160, CDBM_P_SET_DATABASES, CDBM_P_SET_THRESHOLDS /* joint databases that are searched together, and its name */
};

typedef struct cdbm_part_entry { uint32_t kind, number; uint64_t at, n_bytes; } cdbm_part_entry;

typedef struct cdbm_bundle {
    const unsigned char *bytes;
    const cdbm_part_entry *parts;
    size_t size, n_parts;
    const char *why;     /* why it is refused; NULL while it is not */
} cdbm_bundle;

static inline void cdbm_refuse(cdbm_bundle *bundle, const char *why)
{
    if (!bundle->why) bundle->why = why;
}

/* Open a bundle that stays where it is, on an address that 16 divides. Why it is refused, or NULL. */
static inline const char *cdbm_open_bundle(cdbm_bundle *bundle, const void *bytes, size_t size)
{
    uint64_t numbers[8];
    size_t i;
    memset(bundle, 0, sizeof *bundle);
    bundle->bytes = (const unsigned char *)bytes, bundle->size = size;
    if (((uintptr_t)bytes & 15) != 0) return bundle->why = "the memory does not begin on an address that 16 divides";
    if (size < sizeof numbers || memcmp(bytes, CDBM_MAGIC, 7) != 0) return bundle->why = "it is no bundle of motion";
    if (memcmp(bytes, CDBM_MAGIC, 8) != 0) return bundle->why = "the bundle is of another version: build it again";
    memcpy(numbers, bytes, sizeof numbers);
    if (numbers[1] != size) return bundle->why = "the bundle is not as long as it says";
    if (numbers[3] > (size - sizeof numbers) / sizeof(cdbm_part_entry)) return bundle->why = "the bundle is too short for its parts";
    bundle->n_parts = (size_t)numbers[3];
    bundle->parts = (const cdbm_part_entry *)(const void *)(bundle->bytes + sizeof numbers);
    for (i = 0; i < bundle->n_parts; i++)
        if (bundle->parts[i].at % 64 != 0 || bundle->parts[i].at > size || bundle->parts[i].n_bytes > size - bundle->parts[i].at)
            return bundle->why = "a part does not lie within the bundle";
    return NULL;
}

/* Whether the contents are those that were built: reads all of it. */
static inline int cdbm_has_digest(const cdbm_bundle *bundle)
{
    uint64_t numbers[3], sum = 0, word;
    size_t at;
    memcpy(numbers, bundle->bytes, sizeof numbers);
    for (at = 24; at + 8 <= bundle->size; at += 8) {
        memcpy(&word, bundle->bytes + at, 8);
        word = (word ^ (uint64_t)at) * 0x9E3779B97F4A7C15;
        sum += word ^ (word >> 32);
    }
    return sum == numbers[2];
}

/* A part, and how many things of so many bytes it holds; NULL where there is none, or it holds no whole number of them. */
static inline const void *cdbm_find(const cdbm_bundle *bundle, uint32_t kind, size_t number, size_t size, size_t *n)
{
    size_t i;
    for (i = 0; i < bundle->n_parts; i++)
        if (bundle->parts[i].kind == kind && bundle->parts[i].number == number) {
            *n = (size_t)bundle->parts[i].n_bytes / size;
            return bundle->parts[i].n_bytes % size == 0 ? bundle->bytes + bundle->parts[i].at : NULL;
        }
    *n = 0;
    return NULL;
}

/* A part of just so many things; refuses the bundle where there is none. */
static inline const void *cdbm_array(cdbm_bundle *bundle, uint32_t kind, size_t number, size_t size, size_t n)
{
    size_t n_there;
    const void *items = cdbm_find(bundle, kind, number, size, &n_there);
    if (!items || n_there != n) cdbm_refuse(bundle, "a part is missing, or has another length than it must have");
    return n_there == n ? items : NULL;
}

/* A part with any number of things. */
static inline const void *cdbm_array_of(cdbm_bundle *bundle, uint32_t kind, size_t number, size_t size, size_t *n)
{
    const void *items = cdbm_find(bundle, kind, number, size, n);
    if (!items) cdbm_refuse(bundle, "a part is missing");
    return items;
}

/* A text of a part, which is texts one after another, each ended by 0; NULL where there are fewer. */
static inline const char *cdbm_text(const cdbm_bundle *bundle, uint32_t kind, size_t number, size_t i)
{
    size_t n, at = 0;
    const char *texts = (const char *)cdbm_find(bundle, kind, number, 1, &n);
    if (!texts || n == 0 || texts[n - 1] != 0) return NULL;
    for (; i > 0 && at < n; i--) at += strlen(texts + at) + 1;
    return at < n ? texts + at : NULL;
}

/* The text behind one that cdbm_text gave; NULL behind the last. */
static inline const char *cdbm_next_text(const cdbm_bundle *bundle, uint32_t kind, size_t number, const char *text)
{
    size_t n;
    const char *texts = (const char *)cdbm_find(bundle, kind, number, 1, &n);
    text += strlen(text) + 1;
    return text < texts + n ? text : NULL;
}

/* How many things there are that have a part of a kind. */
static inline size_t cdbm_count(const cdbm_bundle *bundle, uint32_t kind)
{
    size_t n, i = 0;
    while (cdbm_find(bundle, kind, i, 1, &n)) i++;
    return i;
}

#define CDBM_TAKE(type, kind, n) ((const type *)cdbm_array(bundle, (kind), number, sizeof(type), (n)))
#define CDBM_TAKE_ALL(type, kind, n) ((const type *)cdbm_array_of(bundle, (kind), number, sizeof(type), (n)))

/* ---- databases */

/* Whether every box lies in its range: what plays is looked up by its frame. */
static inline int cdbm_are_boxes_in_ranges(const cdbm_clips *clips)
{
    const cdbm_frames *frames = clips->frames;
    size_t i;
    for (i = 0; i < frames->n_boxes; i++) {
        size_t range = (size_t)frames->box_ranges[i];
        if (frames->box_starts[i] < clips->starts[range] || frames->box_starts[i] + frames->box_sizes[i] > clips->stops[range]) return 0;
    }
    return 1;
}

static inline size_t cdbm_size_from(double number)
{
    return number >= 0.0 && number < 4e9 ? (size_t)number : (size_t)-1;
}

/* The bounds of a database, which lie in the bundle. */
static inline void cdbm_read_levels(cdbm_bundle *bundle, size_t number, cdbm_frames *frames)
{
    const double *step = CDBM_TAKE(double, CDBM_P_LEVEL_STEP, 1);
    const int16_t *levels[4];
    size_t sizes[4], i;
    for (i = 0; i < 4; i++) levels[i] = CDBM_TAKE_ALL(int16_t, CDBM_P_LEVELS + (uint32_t)i, &sizes[i]);
    if (!bundle->why && !cdbm_use_levels(frames, *step, levels, sizes)) cdbm_refuse(bundle, "the bounds of a database are none");
}

/* Read a database of a bundle; what is made of it is to be given back with cdbm_free_levels. */
static inline void cdbm_read_database(cdbm_bundle *bundle, size_t number, cdbm_frames *frames, cdbm_clips *clips)
{
    const double *own = CDBM_TAKE(double, CDBM_P_DATABASE, 9);
    size_t n = 0, n_all, n_kinds = 0;
    memset(frames, 0, sizeof *frames);
    memset(clips, 0, sizeof *clips);
    if (!own) return;
    frames->n_frames = cdbm_size_from(own[0]), frames->n_kinds = cdbm_size_from(own[1]);
    clips->rate = own[2], clips->continuing = own[3], clips->settle = own[4], clips->n_permutations = cdbm_size_from(own[5]);
    clips->pace = cdbm_size_from(own[6]), clips->n_pace = cdbm_size_from(own[7]), clips->pace_s = own[8];
    frames->offset = CDBM_TAKE_ALL(double, CDBM_P_OFFSET, &frames->n_features);
    frames->box_starts = CDBM_TAKE_ALL(int64_t, CDBM_P_BOX_STARTS, &frames->n_boxes);
    frames->range_boxes = CDBM_TAKE_ALL(int64_t, CDBM_P_RANGE_BOXES, &n);
    frames->n_ranges = n / 2;
    frames->weights = CDBM_TAKE_ALL(double, CDBM_P_WEIGHTS, &frames->n_channels);
    n_all = frames->n_features;
    if (frames->n_frames > (size_t)1 << 31 || frames->n_kinds < 1 || n % 2 || n_all > 1 << 16 || frames->n_boxes > (size_t)1 << 31)
        cdbm_refuse(bundle, "a database has more of something than it can have");
    if (bundle->why) return;
    frames->blocks = CDBM_TAKE(float, CDBM_P_BLOCKS, frames->n_boxes * n_all * CDBM_FRAMES);
    frames->order = CDBM_TAKE(int64_t, CDBM_P_ORDER, n_all), frames->rank = CDBM_TAKE(int64_t, CDBM_P_RANK, n_all);
    frames->box_sizes = CDBM_TAKE(int32_t, CDBM_P_BOX_SIZES, frames->n_boxes);
    frames->box_ranges = CDBM_TAKE(int32_t, CDBM_P_BOX_RANGES, frames->n_boxes);
    frames->box_kinds = CDBM_TAKE(int32_t, CDBM_P_BOX_KINDS, frames->n_boxes);
    frames->kinds = (const int32_t *)cdbm_find(bundle, CDBM_P_KINDS, number, sizeof(int32_t), &n);
    if (frames->kinds && n != frames->n_frames) cdbm_refuse(bundle, "there is not one kind for each frame");
    frames->scale = CDBM_TAKE(double, CDBM_P_SCALE, n_all), frames->roots = CDBM_TAKE(double, CDBM_P_ROOTS, n_all);
    frames->channels = CDBM_TAKE(int64_t, CDBM_P_CHANNELS, frames->n_channels + 1);
    clips->frames = frames, clips->n_ranges = frames->n_ranges;
    clips->starts = CDBM_TAKE(int64_t, CDBM_P_STARTS, clips->n_ranges), clips->stops = CDBM_TAKE(int64_t, CDBM_P_STOPS, clips->n_ranges);
    clips->assets = CDBM_TAKE(int64_t, CDBM_P_ASSET_RANGES, clips->n_ranges);
    clips->keys = CDBM_TAKE(double, CDBM_P_ASSET_KEYS, clips->n_ranges);
    clips->looping = CDBM_TAKE(uint8_t, CDBM_P_LOOPING, clips->n_ranges);
    clips->root = (const float *)cdbm_find(bundle, CDBM_P_ROOT, number, sizeof(float), &n);
    if (clips->root && n != 3 * frames->n_frames) cdbm_refuse(bundle, "there is not one place for each frame");
    clips->marks = CDBM_TAKE_ALL(uint8_t, CDBM_P_MARKS, &n_kinds);
    clips->n_kinds = n_kinds;
    clips->root_weights = CDBM_TAKE(double, CDBM_P_ROOT_WEIGHTS, n_kinds);
    if (bundle->why) return;
    if (!cdbm_is_whole(frames) || !cdbm_are_clips(clips, n_all) || !cdbm_are_boxes_in_ranges(clips))
        cdbm_refuse(bundle, "the boxes, ranges, channels or kinds of a database do not go together");
    else cdbm_read_levels(bundle, number, frames);
}

/* The tags that the markup of a database knows; none where the bundle has none. */
static inline void cdbm_read_tags(cdbm_bundle *bundle, size_t number, size_t n_kinds, cdbm_tag_list *to)
{
    size_t n, i;
    memset(to, 0, sizeof *to);
    to->n_kinds = n_kinds;
    to->names = (const char *)cdbm_find(bundle, CDBM_P_TAGS, number, 1, &n);
    if (bundle->why || !to->names || n == 0) return;
    if (to->names[n - 1] != 0) cdbm_refuse(bundle, "the tags of a database are no texts");
    for (i = 0; i < n; i++) to->n += to->names[i] == 0;
    to->flags = CDBM_TAKE(uint8_t, CDBM_P_KIND_TAGS, n_kinds * to->n);
}

/* ---- banks of poses */

static inline void cdbm_read_bank(cdbm_bundle *bundle, size_t number, const cdbo_rig *rig, cdbo_frames *of)
{
    size_t n = 0;
    const double *rate = CDBM_TAKE(double, CDBM_P_POSE_RATE, 1);
    memset(of, 0, sizeof *of);
    of->root = CDBM_TAKE_ALL(float, CDBM_P_POSE_ROOT, &n);
    of->starts = CDBM_TAKE_ALL(int64_t, CDBM_P_POSE_STARTS, &of->n_ranges);
    of->n_frames = n / 3, of->n_joints = rig->n_joints, of->n_moving = rig->n_moving, of->n_feet = rig->n_feet;
    if (n % 3 || of->n_frames > (size_t)1 << 31) cdbm_refuse(bundle, "there is not one root for each frame of poses");
    if (bundle->why) return;
    of->rotations = CDBM_TAKE(float, CDBM_P_POSE_ROTATIONS, 4 * of->n_frames * of->n_joints);
    of->positions = CDBM_TAKE(float, CDBM_P_POSE_POSITIONS, 3 * of->n_frames * of->n_moving);
    of->ways = CDBM_TAKE(double, CDBM_P_POSE_WAYS, 6 * of->n_frames);
    of->contacts = CDBM_TAKE(unsigned char, CDBM_P_POSE_CONTACTS, of->n_frames * of->n_feet);
    of->steps = CDBM_TAKE(double, CDBM_P_POSE_STEPS, 3 * of->n_frames * of->n_feet);
    of->n_steps = CDBM_TAKE(int64_t, CDBM_P_POSE_N_STEPS, of->n_ranges);
    of->looping = CDBM_TAKE(unsigned char, CDBM_P_POSE_LOOPING, of->n_ranges);
    of->rate = rate ? *rate : 0.0;
    if (!bundle->why && !cdbo_are_frames(of)) cdbm_refuse(bundle, "a range of poses does not lie within the frames");
}

static inline void cdbm_read_rig(cdbm_bundle *bundle, size_t number, cdbo_rig *rig, const double *settings)
{
    size_t n = 0;
    memset(rig, 0, sizeof *rig);
    rig->parents = CDBM_TAKE_ALL(int64_t, CDBM_P_PARENTS, &rig->n_joints);
    rig->legs = CDBM_TAKE_ALL(int64_t, CDBM_P_LEGS, &n);
    rig->n_feet = n / 4, rig->n_moving = cdbm_size_from(settings[0]), rig->most_accel = settings[1];
    if (n % 4 || rig->n_joints > 1 << 16 || rig->n_moving > 1 << 16) cdbm_refuse(bundle, "a rig has more joints than it can have");
    rig->tops = CDBM_TAKE_ALL(int64_t, CDBM_P_TOPS, &rig->n_tops), rig->spine = CDBM_TAKE_ALL(int64_t, CDBM_P_SPINE, &rig->n_spine);
    if (bundle->why) return;
    rig->offsets = CDBM_TAKE(double, CDBM_P_OFFSETS, 3 * rig->n_joints), rig->places = CDBM_TAKE(int64_t, CDBM_P_PLACES, rig->n_joints);
    rig->hinges = CDBM_TAKE(double, CDBM_P_HINGES, 3 * rig->n_feet), rig->left = CDBM_TAKE(double, CDBM_P_LEFT, rig->n_spine);
    if (!bundle->why && !cdbo_is_rig(rig)) cdbm_refuse(bundle, "the joints of a rig do not go together");
}
