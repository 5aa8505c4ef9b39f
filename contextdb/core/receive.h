/* ---- From what was decided to what happens to a pose: whether it goes on from what is displayed, and the seam where it does not. */

#define CDBO_NEAR_S 0.1 /* what is displayed goes on where it is not farther from where it should be than this */

typedef struct cdbo_instant { double bank, range, at_s; } cdbo_instant; /* the number of a bank, below 0 for nothing */

typedef struct cdbo_play {   /* all are numbers, as they come in arrays */
    cdbo_instant playing, before, displayed; /* what plays; what would without a search; what was displayed last */
    double action, rate;                    /* number of a word of Action; seconds of the clip in a second */
    double motion[3], weight, gives_ground, blend_s, root; /* as in cdbo_given */
} cdbo_play;

enum { CDBO_ACTION_STARTS, CDBO_ACTION_PLAYS_ON, CDBO_ACTION_JUMPS, CDBO_ACTION_LOOPS, CDBO_ACTION_HOLDS };

/* Whether a decision goes on from what was displayed; else another one has decided meanwhile. */
static inline int cdbo_goes_on(const cdbo_play *play, double passed_s)
{
    int is_new = play->action == CDBO_ACTION_JUMPS || play->action == CDBO_ACTION_STARTS;
    const cdbo_instant *on = is_new ? &play->before : &play->playing, *displayed = &play->displayed;
    if (on->bank < 0.0 || on->bank != displayed->bank || on->range != displayed->range) return 0;
    if (play->action == CDBO_ACTION_LOOPS) return 1;
    return -CDBO_NEAR_S <= on->at_s - displayed->at_s && on->at_s - displayed->at_s <= passed_s + CDBO_NEAR_S;
}

static inline void cdbo_set_seam(cdbo_seam *seam, const cdbo_instant *at, double at_s, double rate)
{
    seam->bank = at->bank, seam->range = at->range, seam->at_s = at_s, seam->rate = rate;
}

/* The moment that is left at a seam: behind its end where a clip has run out within the update, and did not stand there. */
static inline void cdbo_leave_clip(const cdbo_poses *poses, const cdbo_instant *was, double until_s, double rate, int is_still, cdbo_seam *seam)
{
    const cdbo_frames *bank = poses->banks[(size_t)was->bank];
    if (was->at_s < (double)bank->n_steps[(size_t)was->range] / bank->rate) cdbo_set_seam(seam, was, was->at_s, rate);
    else cdbo_set_seam(seam, was, is_still ? was->at_s : cdbo_most(was->at_s, until_s), is_still ? 0.0 : rate);
}

/* What happens to a character whose row this is; its two seams, where it has one, go behind `n_seams` others. All moments are of
 * the banks (cdbo_is_moment), or nothing. */
static inline void cdbo_receive(const cdbo_poses *poses, const double *row, const cdbo_play *play, double dt_s, cdbo_given *given,
    cdbo_seam *seams, size_t *n_seams)
{
    double rate = row[poses->at[CDBO_CLIP_RATE]], action = play->action;
    cdbo_instant before = play->before;
    int is_new = action == CDBO_ACTION_JUMPS || action == CDBO_ACTION_STARTS;
    memset(given, 0, sizeof *given);
    given->bank = play->playing.bank, given->range = play->playing.range, given->at_s = play->playing.at_s;
    given->is_on = play->displayed.bank >= 0.0, given->rate = play->rate, given->weight = play->weight, given->seam = -1.0;
    given->gives_ground = play->gives_ground, given->blend_s = play->blend_s, given->root = play->root;
    memcpy(given->motion, play->motion, sizeof given->motion);
    if (given->is_on != 0.0 && given->bank >= 0.0) {
        double passed_s = dt_s * rate, until_s = play->displayed.at_s + passed_s;
        if (!cdbo_goes_on(play, passed_s)) {
            given->is_ahead = !is_new || before.bank < 0.0;
            before = play->displayed, before.at_s = until_s;
            if (!is_new) action = CDBO_ACTION_JUMPS;
        }
        if (action == CDBO_ACTION_LOOPS || action == CDBO_ACTION_JUMPS || action == CDBO_ACTION_STARTS) {
            cdbo_seam *own = seams + *n_seams;
            const cdbo_frames *bank = poses->banks[(size_t)given->bank];
            given->seam = (double)(*n_seams / 2);
            *n_seams += 2;
            if (action == CDBO_ACTION_LOOPS) {
                cdbo_set_seam(&own[0], &play->playing, (double)bank->n_steps[(size_t)given->range] / bank->rate, rate);
                cdbo_set_seam(&own[1], &play->playing, 0.0, play->rate);
            } else {
                if (before.bank < 0.0) before = play->displayed;
                cdbo_leave_clip(poses, &before, until_s, rate, row[poses->at[CDBO_PLAY_RATE]] == 0.0, &own[0]);
                cdbo_set_seam(&own[1], &play->playing, play->playing.at_s, play->rate);
                if (play->before.bank >= 0.0 && given->is_ahead == 0.0 && rate != 0.0) given->lost_s = (own[0].at_s - before.at_s) / rate;
            }
        }
    }
    given->action = action == CDBO_ACTION_PLAYS_ON ? CDBO_CONTINUES : action == CDBO_ACTION_HOLDS ? CDBO_HOLDS : CDBO_DOES_ELSE;
}
