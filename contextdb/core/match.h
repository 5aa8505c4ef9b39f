/* ---- Match nodes: a one-off is chosen when it is entered, among the animations of a database, for the pose that a character is in and
 * for a target.
 *
 *   cdbm_enter        the frame of lowest cost, and the way from it to the target; the character does not play it yet
 *   cdbm_seen_at      a place in the world as a target
 *
 * Give the block as `one_off` of the inputs of each update until cdbm_is_over. What the character would play without it goes on below,
 * with its body. A gate is the cost, see cdbm_open_gate: enter each time, and play it when it opens. */

typedef struct cdbm_match {
    size_t database;                /* among those of the controller, see cdbm_database_number */
    cdbm_target target;
    double position_weight, rotation_weight; /* of a square metre from the target, and of a square radian */
    const double *query;            /* [F] the pose that it is to begin with; NULL: that of the moment */
} cdbm_match;

/* The number of a database of a player by its name; -1 for none. */
static inline int cdbm_database_number(const cdbm_player *player, const char *name)
{
    size_t i;
    for (i = 0; i < player->controller.n_databases; i++) {
        const char *own = cdbm_text(&player->bundle, CDBM_P_NAME, (size_t)player->database_of[i], 0);
        if (own && strcmp(own, name) == 0) return (int)i;
    }
    return -1;
}

/* A place in the world as a character sees it from where its animation is; heading NaN: as the animation brings it about. */
static inline cdbm_target cdbm_seen_at(const double *state, double x, double z, double heading)
{
    cdbm_target target;
    double origin[3], way[2];
    cdbm_place_of(state, origin);
    cdbm_seen(x - origin[0], z - origin[1], origin[2], way);
    target.left = way[0], target.ahead = way[1], target.turn = heading - origin[2];
    return target;
}

/* How many bytes of room an entry takes. */
static inline size_t cdbm_enter_room(const cdbm_player *player)
{
    size_t n_frames = 0, n_kinds = 0, search = 0, i;
    for (i = 0; i < player->controller.n_databases; i++) {
        const cdbm_clips *clips = &player->clips[i];
        if (clips->frames->n_frames > n_frames) n_frames = clips->frames->n_frames;
        if (clips->n_kinds > n_kinds) n_kinds = clips->n_kinds;
        if (cdbm_search_room(clips->frames, 1) > search) search = cdbm_search_room(clips->frames, 1);
    }
    return cdbm_rounded(player->n_ranges) + 2 * cdbm_rounded(player->n_ranges * sizeof(double)) + cdbm_rounded(n_kinds) + search
        + 2 * cdbm_rounded(n_frames * sizeof(double)) + cdbm_rounded(player->controller.n_features * sizeof(double))
        + cdbm_answer_room(player) + 64;
}

/* What the way to the target adds to each frame; infinite but for the frame at which the row of a range says that it is entered. */
static inline void cdbm_write_aims(const cdbm_player *player, const cdbm_match *match, const cdbm_target *target, const int64_t *play_of,
    double *biases, double *room)
{
    const cdbm_clips *clips = &player->clips[match->database];
    double weights[2];
    size_t r;
    int64_t i;
    weights[0] = match->position_weight, weights[1] = match->rotation_weight;
    cdbm_aim(player->ends[match->database], clips->frames->n_frames, target, weights, biases, room);
    for (i = 0; (uint64_t)i < clips->frames->n_frames; i++) biases[i] += room[i];
    for (r = 0; player->plays && r < clips->n_ranges; r++) {
        int64_t own = play_of[clips->range_at + r], entry;
        if (own < 0 || !(player->plays[own].start_s == player->plays[own].start_s) || clips->starts[r] == clips->stops[r]) continue;
        entry = cdbm_frame_at(clips, r, player->plays[own].start_s);
        for (i = clips->starts[r]; i < clips->stops[r]; i++)
            if (i != entry) biases[i] = (double)INFINITY;
    }
}

/* Choose a one-off for a character as it stands, among what the facts, or the rows, of `input` let play. 1, and the one-off, whose range
 * is -1 and whose cost is infinite where nothing may play; 0 with too little room, see cdbm_enter_room; -1 where a number is none, or the
 * database has no match nodes; -2 for a fact that is refused. */
static inline int cdbm_enter(const cdbm_player *player, const double *state, const cdbm_input *input, const cdbm_match *match,
    cdbm_one_off *to, cdbm_room room)
{
    const cdbm_clips *clips = match->database < player->controller.n_databases ? &player->clips[match->database] : NULL;
    uint8_t *ranges = (uint8_t *)cdbm_part(&room, player->n_ranges), *allowed;
    double *range_biases = (double *)cdbm_part(&room, player->n_ranges * sizeof(double)), *biases, *others, *query;
    int64_t *play_of = (int64_t *)cdbm_part(&room, player->n_ranges * sizeof(int64_t)), current = -1, frame = -1, range = CDBM_REFUSED, chosen;
    cdbm_target target = match->target;
    cdbm_question asked;
    cdbm_hits hits;
    cdbm_moved moved;
    cdb_row_play play;
    double cost = (double)INFINITY;
    size_t k;
    int is_done;
    if (!clips || !player->ends[match->database]) return -1;
    if (!(cdbo_size(target.left) <= 1e6 && cdbo_size(target.ahead) <= 1e6)) return -1;
    if (!(match->position_weight >= 0.0 && match->position_weight <= 1e6 && match->rotation_weight >= 0.0 && match->rotation_weight <= 1e6)) return -1;
    target.turn = cdbo_remainder(target.turn);
    allowed = (uint8_t *)cdbm_part(&room, clips->n_kinds), query = (double *)cdbm_part(&room, clips->frames->n_features * sizeof(double));
    biases = (double *)cdbm_part(&room, clips->frames->n_frames * sizeof(double));
    others = (double *)cdbm_part(&room, clips->frames->n_frames * sizeof(double));
    if (!ranges || !range_biases || !play_of || !allowed || !query || !biases || !others) return 0;
    is_done = cdbm_let_play(player, input, state, ranges, range_biases, play_of, room);
    if (is_done != 1) return is_done;
    cdbm_move(&player->controller, cdbm_played_part(player, (double *)(uintptr_t)state), 0.0, &moved);
    if (match->query) memcpy(query, match->query, clips->frames->n_features * sizeof(double));
    else if (moved.to.database < 0.0) cdbm_rest_pose(&player->ways, state, player->frames[0].offset, query);
    else cdbm_features(player->clips[(size_t)moved.to.database].frames, (int64_t)moved.to.frame, query);
    cdbm_write_aims(player, match, &target, play_of, biases, others);
    for (k = 0; k < clips->n_kinds; k++) allowed[k] = player->allowed[clips->kind_at + k] && clips->marks[k] & CDBM_IN_MATCH_RANGE;
    memset(&asked, 0, sizeof asked);
    asked.n_queries = 1, asked.queries = query, asked.ranges = ranges + clips->range_at, asked.is_one_mask = 1;
    asked.range_biases = range_biases + clips->range_at, asked.are_same_biases = 1, asked.allowed = allowed;
    asked.playable = player->playable + clips->kind_at, asked.kind_biases = player->kind_biases + clips->kind_at;
    asked.frame_biases = biases, asked.currents = &current, asked.within = (double)INFINITY;
    hits.totals = &cost, hits.frames = &frame, hits.ranges = &range;
    if (!cdbm_search_frames(clips->frames, &asked, 0, 1, &hits, room)) return 0;
    if (range == CDBM_REFUSED) return -1;
    memset(to, 0, sizeof *to);
    to->database = (double)match->database, to->range = (double)range, to->cost = cost, to->rate = 1.0;
    if (range < 0) return to->range = -1.0, 1;
    chosen = play_of[clips->range_at + (size_t)range];
    play = chosen < 0 ? cdbm_plain_play() : player->plays[chosen];
    cdbm_place_of(state, to->origin);
    cdbm_begin_one_off(clips, (size_t)range, frame, &play, player->warps[match->database] + 4 * range, &target, to);
    return 1;
}

/* Whether a one-off has played to its end. */
static inline int cdbm_is_over(const cdbm_player *player, const cdbm_one_off *one)
{
    return cdbm_is_done(&player->clips[(size_t)one->database], one);
}
