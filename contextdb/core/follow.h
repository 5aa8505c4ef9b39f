/* ---- What a copy of a character on another machine must be told to play what its owner plays: a packet of a few bytes an update.
 *
 *   1 byte     version, whether it was entered at this update, whether its row says how it plays
 *   1-5 each   numbers of database, range, and frame of the range: seven bits a byte, the lowest first (LEB128)
 *   1 + 8 each where the row says so: which of its numbers are there, the first as the highest bit; and those
 *
 * Each packet says all of what plays, so that after lost ones the next that arrives puts the copy right: where it entered a clip too
 * late it is at most a frame off, until the next entry is told at its moment. Nothing is in it of where the body is. */

#define CDBM_MOST_PACKET 96 /* bytes */
enum { CDBM_PACKET = 1 << 2, CDBM_IS_NEW = 1, CDBM_HAS_PLAY = 2 };
#define CDBM_NEAR_FRAMES 1.0 /* a copy that is so many frames off is not put right: it would jump */

typedef struct cdbm_followed {   /* what a packet says, in doubles alone */
    double database, range, frame, is_new; /* frame: of the database; no database: nothing is told */
    double enters;               /* whether a copy jumps to it, as it plays on something else */
    cdb_row_play play;
} cdbm_followed;

/* Write what plays into a packet; how many bytes it is, 0 where nothing does. */
static inline size_t cdbm_pack_row(const cdbm_controller *controller, const double *row, uint8_t *packet)
{
    const cdbm_state *state = (const cdbm_state *)row;
    const double *play = &state->play.blend_s;
    uint64_t numbers[3];
    size_t n = 1, i, mask_at;
    if (state->playing.database < 0.0) return 0;
    numbers[0] = (uint64_t)state->playing.database, numbers[1] = (uint64_t)state->playing.range;
    numbers[2] = (uint64_t)((int64_t)state->playing.frame - controller->databases[numbers[0]].starts[numbers[1]]);
    for (i = 0; i < 3; i++) {
        for (; numbers[i] > 0x7F; numbers[i] >>= 7) packet[n++] = (uint8_t)((numbers[i] & 0x7F) | 0x80);
        packet[n++] = (uint8_t)numbers[i];
    }
    mask_at = n++, packet[mask_at] = 0;
    for (i = 0; i < 8; i++) {
        if (play[i] != play[i]) continue;
        packet[mask_at] = (uint8_t)(packet[mask_at] | 0x80 >> i);
        memcpy(packet + n, &play[i], 8), n += 8;
    }
    packet[0] = (uint8_t)(CDBM_PACKET | (state->entered_s == state->time_s ? CDBM_IS_NEW : 0) | (packet[mask_at] ? CDBM_HAS_PLAY : 0));
    return packet[mask_at] ? n : mask_at;
}

/* Whether what would play on is what is followed, but for a frame. */
static inline int cdbm_is_met(const cdbm_clips *clips, const cdbm_followed *followed, const cdbm_moved *moved)
{
    size_t range = (size_t)followed->range;
    double apart = cdbo_size(moved->to.frame - followed->frame), n_frames = (double)(clips->stops[range] - clips->starts[range]);
    if (followed->is_new != 0.0 || moved->to.database != followed->database || moved->to.range != followed->range) return 0;
    return (clips->looping[range] ? cdbo_least(apart, n_frames - apart) : apart) <= CDBM_NEAR_FRAMES;
}

/* Read a packet, of no bytes where none arrived, for a copy that would play on as it has moved. 0 for what is no packet of a character
 * with these databases. */
static inline int cdbm_read_packet(const cdbm_controller *controller, const uint8_t *packet, size_t n, const cdbm_moved *moved,
    cdbm_followed *to)
{
    const cdbm_clips *clips;
    double *play = &to->play.blend_s;
    uint64_t numbers[3];
    size_t at = 1, i;
    memset(to, 0, sizeof *to);
    to->play = cdbm_plain_play(), to->database = CDBM_NO_DATABASE;
    if (n == 0) return 1;
    for (i = 0; i < 3; i++) {
        size_t first = at;
        for (numbers[i] = 0;; at++) {
            if (at >= n || at - first > 4) return 0;
            numbers[i] |= (uint64_t)(packet[at] & 0x7F) << (7 * (at - first));
            if (packet[at] < 0x80) break;
        }
        at++;
    }
    if ((packet[0] & ~(CDBM_IS_NEW | CDBM_HAS_PLAY)) != CDBM_PACKET || numbers[0] >= controller->n_databases) return 0;
    clips = &controller->databases[numbers[0]];
    if (!clips->frames || numbers[1] >= clips->n_ranges || numbers[2] >= (uint64_t)(clips->stops[numbers[1]] - clips->starts[numbers[1]])) return 0;
    if (packet[0] & CDBM_HAS_PLAY) {
        uint8_t mask = at < n ? packet[at++] : 0;
        if (!mask) return 0;
        for (i = 0; i < 8; i++) {
            if (!(mask & 0x80 >> i)) continue;
            if (n - at < 8) return 0;
            memcpy(&play[i], packet + at, 8), at += 8;
            if (!(cdbo_size(play[i]) < (double)INFINITY)) return 0;
        }
    }
    if (at != n) return 0;
    to->database = (double)numbers[0], to->range = (double)numbers[1], to->is_new = packet[0] & CDBM_IS_NEW;
    to->frame = (double)(clips->starts[numbers[1]] + (int64_t)numbers[2]);
    to->enters = !cdbm_is_met(clips, to, moved);
    return 1;
}

/* Put what is followed in the place of a search, after cdbm_ask. */
static inline void cdbm_take_followed(const cdbm_followed *followed, cdbm_decision *decision)
{
    if (followed->enters != 0.0) {
        decision->winner = decision->chosen[0] = followed->database;
        decision->chosen[1] = followed->range, decision->chosen[2] = followed->frame, decision->chosen[3] = 0.0;
    } else if (decision->cause == CDBM_DUE) decision->cause = CDBM_NOT_DUE;
}
