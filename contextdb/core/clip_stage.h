/* ---- The first stage: the pose of the clip that plays, between two of its frames; where nothing plays, the last one. */

static const cdbo_column_record cdbo_clip_columns[] = {
    {CDBO_BEGUN, "begun", CDBO_ONE, 1, 0.0},
    {CDBO_TIME, "time", CDBO_ONE, 1, 0.0},
    {CDBO_PLAY_RATE, "play_rate", CDBO_ONE, 1, 1.0},
    {CDBO_CLIP_RATE, "clip_rate", CDBO_ONE, 1, 1.0},
    {CDBO_CLIP_ROOT, "clip_root", CDBO_ONE, 3, 0.0},
    {CDBO_ROTATIONS, "rotations", CDBO_EACH_JOINT, 4, 1.0},
    {CDBO_POSITIONS, "positions", CDBO_EACH_MOVING, 3, 0.0},
};

/* Seconds of the clip in a second of play, where it plays on; else what it was. */
static inline double cdbo_play_rate(const cdbo_posed *one)
{
    const cdbo_given *given = one->given;
    double was = *cdbo_was(one, CDBO_PLAY_RATE);
    if (given->action == CDBO_HOLDS) return 0.0;
    if (given->action != CDBO_CONTINUES || !one->frames || given->is_on == 0.0 || one->dt_s <= 0.0) return was != 0.0 ? was : 1.0;
    return (given->at_s - *cdbo_was(one, CDBO_TIME)) / one->dt_s;
}

/* Which feet are down, and how the clip goes. */
static inline void cdbo_enter_frame(cdbo_posed *one, cdbo_between at)
{
    const cdbo_frames *frames = one->frames;
    const double *a = frames->ways + 6 * at.low, *b = frames->ways + 6 * at.high;
    size_t i;
    for (i = 0; i < 3; i++) {
        cdbo_column(one, CDBO_CLIP_ROOT)[i] = a[i] + at.share * (b[i] - a[i]);
        one->travel[i] = a[3 + i] + at.share * (b[3 + i] - a[3 + i]);
    }
    one->frame = at.share >= 0.5 ? at.high : at.low;
    memcpy(one->contacts, frames->contacts + frames->n_feet * one->frame, frames->n_feet);
}

static inline void cdbo_run_clip(cdbo_posed *one)
{
    const cdbo_rig *rig = &one->poses->rig;
    const double *positions = cdbo_column(one, CDBO_POSITIONS);
    size_t i;
    *cdbo_column(one, CDBO_BEGUN) = 1.0;
    *cdbo_column(one, CDBO_PLAY_RATE) = cdbo_play_rate(one);
    *cdbo_column(one, CDBO_CLIP_RATE) = one->given->rate;
    *cdbo_column(one, CDBO_TIME) = one->frames ? one->given->at_s : *cdbo_was(one, CDBO_TIME);
    if (one->frames) {
        cdbo_between at = cdbo_frames_at(one->frames, (size_t)one->given->range, one->given->at_s);
        cdbo_sample(one->frames, at, cdbo_column(one, CDBO_ROTATIONS), cdbo_column(one, CDBO_POSITIONS));
        cdbo_enter_frame(one, at);
    } else {
        cdbo_keep(one, CDBO_CLIP_ROOT, 3);
        cdbo_keep(one, CDBO_ROTATIONS, 4 * rig->n_joints);
        cdbo_keep(one, CDBO_POSITIONS, 3 * rig->n_moving);
        memset(one->contacts, 0, rig->n_feet);
    }
    memcpy(one->rotations, cdbo_column(one, CDBO_ROTATIONS), 4 * rig->n_joints * sizeof(double));
    for (i = 0; i < rig->n_joints; i++) cdbo_set3(one->translations, i, cdbo_translation(rig, positions, i));
}

static const cdbo_stage cdbo_clip_stage = {"clip", cdbo_clip_columns, CDBO_COUNT(cdbo_clip_columns), NULL, 0, NULL, cdbo_run_clip};
