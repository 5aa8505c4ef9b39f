/* ---- An event that is to happen at a moment: which frames lead to it, and how far it is. See contextdb/motion/selection/events.py.
 *
 * Where an event begins is in the bundle, as frames of each database, by its name. */

typedef struct cdbm_events { const int64_t *starts, *frames; size_t n; } cdbm_events; /* those of event k from starts[k] to starts[k + 1] */

/* Read the events of a database, where the bundle has them. */
static inline void cdbm_read_events(cdbm_bundle *bundle, size_t number, size_t n_frames, cdbm_events *to)
{
    size_t n = 0, n_starts = 0, k;
    memset(to, 0, sizeof *to);
    if (bundle->why || !cdbm_find(bundle, CDBM_P_EVENT_STARTS, number, sizeof(int64_t), &n_starts)) return;
    to->starts = CDBM_TAKE_ALL(int64_t, CDBM_P_EVENT_STARTS, &n_starts), to->frames = CDBM_TAKE_ALL(int64_t, CDBM_P_EVENT_FRAMES, &n);
    if (bundle->why || n_starts == 0) return;
    to->n = n_starts - 1;
    if (to->starts[0] != 0 || (uint64_t)to->starts[to->n] != n) cdbm_refuse(bundle, "the events of a database do not go together");
    for (k = 0; k < to->n; k++)
        if (to->starts[k] > to->starts[k + 1]) cdbm_refuse(bundle, "the events of a database do not go together");
    for (k = 0; k < n; k++)
        if (to->frames[k] < 0 || (uint64_t)to->frames[k] >= n_frames) cdbm_refuse(bundle, "an event is at no frame");
}

/* Where an event of a name begins in a database; 0 where it has none of that name. */
static inline int cdbm_find_event(const cdbm_bundle *bundle, size_t number, const cdbm_events *of, const char *name, const int64_t **begins, size_t *n)
{
    size_t k;
    const char *own;
    for (k = 0; k < of->n && (own = cdbm_text(bundle, CDBM_P_EVENT_NAMES, number, k)) != NULL; k++)
        if (strcmp(own, name) == 0) {
            *begins = of->frames + of->starts[k], *n = (size_t)(of->starts[k + 1] - of->starts[k]);
            return 1;
        }
    return 0;
}

/* Write how far it is from each frame of a range to the next event, in seconds of the clip; NaN where playing on does not come there. */
static inline void cdbm_range_to_event(const cdbm_clips *clips, size_t range, const uint8_t *playable, const int64_t *begins, size_t n, double *to)
{
    int64_t start = clips->starts[range], stop = clips->stops[range], next = stop, excluded = stop, behind = start, f;
    while (n > 0 && begins[n - 1] >= stop) n--;
    for (f = stop; f-- > start;) {
        size_t kind = clips->kind_at + (size_t)(clips->frames->kinds ? clips->frames->kinds[f] : 0);
        if (n > 0 && begins[n - 1] == f) {
            next = f, n--;
            if (behind == start) behind = f + 1;
        }
        if (!playable[kind]) {
            excluded = f;
            if (behind <= f) behind = f + 1;
        }
        to[f] = next < stop && next < excluded ? (double)(next - f) / clips->rate : NAN;
    }
    if (!clips->looping[range] || stop - start < 2 || !(next < stop && next < excluded)) return;
    for (f = stop; f-- > behind;) to[f] = (double)(stop - 1 - f + next - start) / clips->rate;
}

/* Write of a database how far it is to an event, and which frames lead there in so many seconds, at a play rate within the limits of
 * their row or the settings. */
static inline void cdbm_lead_to(const cdbm_controller *controller, const cdbm_clips *clips, const cdb_row_play *plays, const int64_t *play_of,
    const uint8_t *playable, const int64_t *begins, size_t n, double in_s, double *to, uint8_t *leads)
{
    double half = 0.5 / clips->rate;
    size_t f, r;
    for (f = 0; f < clips->frames->n_frames; f++) to[f] = NAN, leads[f] = 0;
    for (r = 0; r < clips->n_ranges; r++) {
        int64_t row = plays ? play_of[clips->range_at + r] : -1, frame;
        double least = row >= 0 && plays[row].min_rate == plays[row].min_rate ? plays[row].min_rate : controller->min_rate;
        double most = row >= 0 && plays[row].max_rate == plays[row].max_rate ? plays[row].max_rate : controller->max_rate;
        cdbm_range_to_event(clips, r, playable, begins, n, to);
        for (frame = clips->starts[r]; frame < clips->stops[r]; frame++)
            leads[frame] = to[frame] >= least * in_s - half && to[frame] <= most * in_s + half;
    }
}
