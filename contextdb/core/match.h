/* ---- Match nodes: a one-off is chosen when it is entered, among the animations of a database, for the pose that a character is in and
 * for a target.
 *
 *   cdbm_enter        the frame of lowest cost, and the way from it to the target; the character does not play it yet
 *   cdbm_stitch       the shortest part of an animation that leads from one pose to another
 *   cdbm_seen_at      a place in the world as a target
 *
 * Give the block as `one_off` of the inputs of each update until cdbm_is_over. What the character would play without it goes on below,
 * with its body. A gate is the cost, see cdbm_open_gate: enter each time, and play it when it opens. */

typedef struct cdbm_match {
    size_t database;                /* among those of the controller, see cdbm_database_number */
    cdbm_target target;
    double position_weight, rotation_weight; /* of a square metre from the target, and of a square radian */
    const double *query;            /* [F] the pose that it is to begin with; NULL: that of the moment */
    const cdbm_tags *tags;          /* which tags the frame at which it is entered must, must not or should have; or NULL */
    const cdbm_named_cost *penalties;  /* what assets cost more; infinite: they may not play */
    size_t n_penalties;
    const uint8_t *frames;          /* [N] at which frames it may be entered; NULL: wherever its marks let it */
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

/* How many bytes of room an entry, or a stitch, takes. */
static inline size_t cdbm_enter_room(const cdbm_player *player)
{
    size_t n_frames = 0, n_kinds = 0, search = 0, i, k;
    for (i = 0; i < player->controller.n_databases; i++) {
        const cdbm_frames *frames = player->clips[i].frames;
        size_t rooms[2];
        rooms[0] = cdbm_search_room(frames, 1), rooms[1] = cdbm_part_room(frames);
        if (frames->n_frames > n_frames) n_frames = frames->n_frames;
        if (player->clips[i].n_kinds > n_kinds) n_kinds = player->clips[i].n_kinds;
        for (k = 0; k < 2; k++)
            if (rooms[k] > search) search = rooms[k];
    }
    return cdbm_rounded(player->n_ranges) + 2 * cdbm_rounded(player->n_ranges * sizeof(double)) + 2 * cdbm_rounded(n_kinds * sizeof(double))
        + cdbm_rounded(n_kinds) + cdbm_rounded(2 * n_kinds) + search + 2 * cdbm_rounded(n_frames * sizeof(double))
        + cdbm_rounded(player->controller.n_features * sizeof(double)) + cdbm_answer_room(player) + 64;
}

typedef struct cdbm_matching {      /* what a match node chooses from, in room */
    const cdbm_clips *clips;
    cdbm_question asked;
    uint8_t *ranges, *allowed;      /* of all databases; [K] */
    double *range_biases, *query, *biases; /* of all databases; [F], [N] */
    int64_t *play_of;               /* of all databases */
    int64_t current;
} cdbm_matching;

/* Let tags say which kinds of frames may be chosen, and what they cost more. 1; 0 with too little room; -1 for a cost that is none; -3 for
 * a tag that the markup does not know. */
static inline int cdbm_let_kinds(const cdbm_tag_list *known, const cdbm_tags *tags, uint8_t *allowed, double *biases, cdbm_room room)
{
    size_t n = known->n_kinds, k;
    double *added = (double *)cdbm_part(&room, n * sizeof(double));
    uint8_t *passes = (uint8_t *)cdbm_part(&room, n), *own = (uint8_t *)cdbm_part(&room, 2 * n);
    if (!tags) return 1;
    if (!added || !passes || !own) return 0;
    if (!cdbm_are_costs(tags->prefer, tags->n_prefer, 0.0, CDBM_MOST_COST) || !cdbm_are_costs(tags->avoid, tags->n_avoid, 0.0, CDBM_MOST_COST)) return -1;
    if (!cdbm_filter_kinds(known, tags, passes, added, own)) return -3;
    for (k = 0; k < n; k++) allowed[k] = allowed[k] && passes[k], biases[k] += added[k];
    return 1;
}

/* Add what assets cost more to their ranges. */
static inline void cdbm_penalise(const cdbm_player *player, const cdbm_match *match, double *range_biases)
{
    size_t number = (size_t)player->database_of[match->database], n_ranges = player->clips[match->database].n_ranges, r, i;
    const char *asset = match->n_penalties > 0 ? cdbm_text(&player->bundle, CDBM_P_ASSETS, number, 0) : NULL;
    for (r = 0; asset && r < n_ranges; r++, asset = cdbm_next_text(&player->bundle, CDBM_P_ASSETS, number, asset))
        for (i = 0; i < match->n_penalties; i++)
            if (strcmp(asset, match->penalties[i].name) == 0) range_biases[r] += match->penalties[i].cost;
}

/* Say what a match node may choose from, for a character as it stands. As cdbm_enter. */
static inline int cdbm_prepare_match(const cdbm_player *player, const double *state, const cdbm_input *input, const cdbm_match *match,
    cdbm_matching *to, cdbm_room *room)
{
    const cdbm_clips *clips = match->database < player->controller.n_databases ? &player->clips[match->database] : NULL;
    double *kind_biases;
    cdbm_moved moved;
    size_t k;
    int is_done;
    memset(to, 0, sizeof *to);
    if (!clips || !player->ends[match->database]) return -1;
    if (!cdbm_are_costs(match->penalties, match->n_penalties, -DBL_MAX, (double)INFINITY)) return -1;
    to->clips = clips, to->current = -1;
    to->ranges = (uint8_t *)cdbm_part(room, player->n_ranges), to->allowed = (uint8_t *)cdbm_part(room, clips->n_kinds);
    to->range_biases = (double *)cdbm_part(room, player->n_ranges * sizeof(double));
    to->play_of = (int64_t *)cdbm_part(room, player->n_ranges * sizeof(int64_t));
    to->query = (double *)cdbm_part(room, clips->frames->n_features * sizeof(double));
    to->biases = (double *)cdbm_part(room, clips->frames->n_frames * sizeof(double));
    kind_biases = (double *)cdbm_part(room, clips->n_kinds * sizeof(double));
    if (!to->ranges || !to->allowed || !to->range_biases || !to->play_of || !to->query || !to->biases || !kind_biases) return 0;
    is_done = cdbm_let_play(player, input, state, to->ranges, to->range_biases, to->play_of, *room);
    if (is_done != 1) return is_done;
    cdbm_penalise(player, match, to->range_biases + clips->range_at);
    for (k = 0; k < clips->n_kinds; k++) to->allowed[k] = player->allowed[clips->kind_at + k] && clips->marks[k] & CDBM_IN_MATCH_RANGE;
    memcpy(kind_biases, player->kind_biases + clips->kind_at, clips->n_kinds * sizeof *kind_biases);
    is_done = cdbm_let_kinds(&player->tags[match->database], match->tags, to->allowed, kind_biases, *room);
    if (is_done != 1) return is_done;
    cdbm_move(&player->controller, cdbm_played_part(player, (double *)(uintptr_t)state), 0.0, &moved);
    if (match->query) memcpy(to->query, match->query, clips->frames->n_features * sizeof(double));
    else if (moved.to.database < 0.0) cdbm_rest_pose(&player->ways, state, player->frames[0].offset, to->query);
    else cdbm_features(player->clips[(size_t)moved.to.database].frames, (int64_t)moved.to.frame, to->query);
    to->asked.n_queries = 1, to->asked.queries = to->query, to->asked.ranges = to->ranges + clips->range_at, to->asked.is_one_mask = 1;
    to->asked.range_biases = to->range_biases + clips->range_at, to->asked.are_same_biases = 1, to->asked.allowed = to->allowed;
    to->asked.playable = player->playable + clips->kind_at, to->asked.kind_biases = kind_biases, to->asked.flags = match->frames;
    to->asked.frame_biases = to->biases, to->asked.currents = &to->current, to->asked.within = (double)INFINITY;
    return 1;
}

/* How the row of a range that is entered plays. */
static inline cdb_row_play cdbm_entered_play(const cdbm_player *player, const cdbm_matching *matching, size_t range)
{
    int64_t own = matching->play_of[matching->clips->range_at + range];
    return own < 0 ? cdbm_plain_play() : player->plays[own];
}

/* One that is not entered yet. */
static inline void cdbm_clear_one_off(const double *state, size_t database, cdbm_one_off *to)
{
    memset(to, 0, sizeof *to);
    to->database = (double)database, to->range = -1.0, to->cost = (double)INFINITY, to->rate = 1.0;
    cdbm_place_of(state, to->origin);
}

/* Choose a one-off for a character as it stands, among what the facts, or the rows, of `input` let play. 1, and the one-off, whose range
 * is -1 and whose cost is infinite where nothing may play; 0 with too little room, see cdbm_enter_room; -1 where a number is none, or the
 * database has no match nodes; -2 for a fact that is refused; -3 for a tag that the markup does not know. */
static inline int cdbm_enter(const cdbm_player *player, const double *state, const cdbm_input *input, const cdbm_match *match,
    cdbm_one_off *to, cdbm_room room)
{
    cdbm_target target = match->target;
    cdbm_matching matching;
    double weights[2], *rotations, cost = (double)INFINITY;
    int64_t frame = -1, range = CDBM_REFUSED;
    cdb_row_play play;
    cdbm_hits hits;
    size_t i, n;
    int is_done;
    weights[0] = match->position_weight, weights[1] = match->rotation_weight;
    if (!(cdbo_size(target.left) <= 1e6 && cdbo_size(target.ahead) <= 1e6)) return -1;
    for (i = 0; i < 2; i++)
        if (!(weights[i] >= 0.0 && weights[i] <= 1e6)) return -1;
    is_done = cdbm_prepare_match(player, state, input, match, &matching, &room);
    if (is_done != 1) return is_done;
    n = matching.clips->frames->n_frames, target.turn = cdbo_remainder(target.turn);
    rotations = (double *)cdbm_part(&room, n * sizeof(double));
    if (!rotations) return 0;
    cdbm_aim(player->ends[match->database], n, &target, weights, matching.biases, rotations);
    for (i = 0; i < n; i++) matching.biases[i] += rotations[i];
    cdbm_forbid_others(matching.clips, player->plays, matching.play_of + matching.clips->range_at, matching.biases);
    hits.totals = &cost, hits.frames = &frame, hits.ranges = &range;
    if (!cdbm_search_frames(matching.clips->frames, &matching.asked, 0, 1, &hits, room)) return 0;
    if (range == CDBM_REFUSED) return -1;
    cdbm_clear_one_off(state, match->database, to);
    if (range < 0) return 1;
    play = cdbm_entered_play(player, &matching, (size_t)range), to->cost = cost;
    cdbm_begin_one_off(matching.clips, (size_t)range, frame, &play, player->warps[match->database] + 4 * range, &target, to);
    return 1;
}

/* Choose the shortest part of an animation that leads from the pose of a match to another one, [F], and costs at most so much at both ends
 * together, to be played as it is. The target and its weights do not count. As cdbm_enter. */
static inline int cdbm_stitch(const cdbm_player *player, const double *state, const cdbm_input *input, const cdbm_match *match,
    const double *after, double most_cost, cdbm_one_off *to, cdbm_room room)
{
    cdbm_matching matching;
    cdbm_stretch part;
    cdb_row_play play;
    size_t range;
    int is_done;
    if (!(most_cost >= 0.0)) return -1;
    is_done = cdbm_prepare_match(player, state, input, match, &matching, &room);
    if (is_done != 1) return is_done;
    memset(matching.biases, 0, matching.clips->frames->n_frames * sizeof *matching.biases);
    cdbm_forbid_others(matching.clips, player->plays, matching.play_of + matching.clips->range_at, matching.biases);
    is_done = cdbm_shortest_part(matching.clips, &matching.asked, after, most_cost, &part, room);
    if (is_done != 1) return is_done;
    cdbm_clear_one_off(state, match->database, to);
    if (part.first < 0) return 1;
    range = (size_t)matching.clips->frames->box_ranges[cdbm_box_of(matching.clips->frames, part.first)];
    play = cdbm_entered_play(player, &matching, range);
    cdbm_begin_part(matching.clips, range, &part, &play, to);
    return 1;
}

/* Whether a one-off has played to its end. */
static inline int cdbm_is_over(const cdbm_player *player, const cdbm_one_off *one)
{
    return cdbm_is_done(&player->clips[(size_t)one->database], one);
}
