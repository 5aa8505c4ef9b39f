/* All parts of the poses, in the order in which each needs those before it: what plays, for N characters at once, each a row of
 * numbers.
 *
 *   cdbo_poses_open    a rig, its banks and settings, all checked: the stages, and where their columns are
 *   cdbo_poses_begin   the row of a character that has not displayed anything yet
 *   cdbo_receive       from what was decided to what happens to a pose
 *   cdbo_pose_one      one character through all stages; or, where a game has a ground, up to it, and then from there */

#if defined(__clang__) /* numbers of words go among others, as doubles */
#pragma clang diagnostic ignored "-Wunknown-warning-option"
#pragma clang diagnostic ignored "-Wenum-float-conversion"
#endif
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifndef CDBI_MINUS_ZERO /* with the tables' parts it is there already */
#ifndef CDB_API
#define CDB_API static inline
#endif
#include "arithmetic.h"
#endif
#include "elementary.h"
#include "quaternions.h"
#include "spring.h"
#include "paths.h"
#include "frames.h"
#include "skeletons.h"
#include "legs.h"
#include "ground.h"
#include "pose.h"
#include "clip_stage.h"
#include "spring_stage.h"
#include "root_stage.h"
#include "alignment_stage.h"
#include "feet_state.h"
#include "ground_stage.h"
#include "feet_stage.h"

/* The last stage: all joints in the world. */
static inline void cdbo_run_placing(cdbo_posed *one)
{
    const cdbo_rig *rig = &one->poses->rig;
    cdbo_place(rig->parents, rig->n_joints, one->translations, one->rotations, one->root, one->positions, one->world);
}

static const cdbo_stage cdbo_placing_stage = {"placing", NULL, 0, NULL, 0, NULL, cdbo_run_placing};

static const cdbo_stage *const CDBO_STAGES[] = {&cdbo_clip_stage, &cdbo_spring_stage, &cdbo_root_stage, &cdbo_alignment_stage,
    &cdbo_ground_stage, &cdbo_feet_stage, &cdbo_placing_stage};

/* How many numbers a column has. */
static inline size_t cdbo_column_width(const cdbo_column_record *column, const cdbo_rig *rig)
{
    size_t n = column->each == CDBO_EACH_JOINT ? rig->n_joints : column->each == CDBO_EACH_MOVING ? rig->n_moving
        : column->each == CDBO_EACH_FOOT ? rig->n_feet : 1;
    return n * column->width;
}

/* Give the columns of one stage that are single numbers, or those that are not, their places. */
static inline void cdbo_place_columns(cdbo_poses *poses, const cdbo_stage *stage, int is_single)
{
    size_t k;
    for (k = 0; k < stage->n_columns; k++) {
        const cdbo_column_record *column = &stage->columns[k];
        if ((column->each == CDBO_ONE) != is_single) continue;
        poses->at[column->column] = poses->width;
        poses->width += cdbo_column_width(column, &poses->rig);
    }
}

/* Single numbers, those of all stages, come first: they are in the same place whatever the rig and the settings. */
static inline void cdbo_place_single(cdbo_poses *poses)
{
    size_t i;
    poses->width = 0;
    for (i = 0; i < CDBO_COUNT(CDBO_STAGES); i++) cdbo_place_columns(poses, CDBO_STAGES[i], 1);
}

/* Take a rig, its banks and settings over, once they are written there: settings as their words are, numbers of words for words.
 * Gives 0 where parts do not go together. */
static inline int cdbo_poses_open(cdbo_poses *poses)
{
    size_t i, k;
    if (!cdbo_is_rig(&poses->rig)) return 0;
    for (i = 0; i < poses->n_banks; i++) {
        const cdbo_frames *bank = poses->banks[i];
        if (bank->n_joints != poses->rig.n_joints || bank->n_moving != poses->rig.n_moving) return 0;
        if (bank->n_feet != poses->rig.n_feet) return 0;
    }
    for (i = 0; i < CDBO_COUNT(CDBO_STAGES); i++)
        for (k = 0; k < CDBO_STAGES[i]->n_settings; k++) {
            const cdbo_setting_record *record = &CDBO_STAGES[i]->settings[k];
            double *value = &poses->settings[record->setting];
            if (record->unit == CDBO_DAMPING) *value = cdbo_damping(*value);
            if (record->unit == CDBO_RADIANS) *value *= CDBO_PI / 180.0;
        }
    poses->n_stages = 0;
    for (i = 0; i < CDBO_COUNT(CDBO_STAGES); i++) {
        if (CDBO_STAGES[i]->is_on && !CDBO_STAGES[i]->is_on(poses->settings)) continue;
        if (CDBO_STAGES[i] == &cdbo_ground_stage) poses->n_before_ground = poses->n_stages;
        poses->stages[poses->n_stages++] = CDBO_STAGES[i];
    }
    cdbo_place_single(poses);
    for (i = 0; i < poses->n_stages; i++) cdbo_place_columns(poses, poses->stages[i], 0);
    return 1;
}

/* The row of a character that has not displayed anything yet: the rig at rest. */
static inline void cdbo_poses_begin(const cdbo_poses *poses, double *row)
{
    const cdbo_rig *rig = &poses->rig;
    size_t i, k, n;
    memset(row, 0, poses->width * sizeof(double));
    for (i = 0; i < poses->n_stages; i++)
        for (k = 0; k < poses->stages[i]->n_columns; k++) {
            const cdbo_column_record *column = &poses->stages[i]->columns[k];
            for (n = 0; n < cdbo_column_width(column, rig); n += column->width)
                row[poses->at[column->column] + n] = column->first;
        }
    for (i = 0; i < rig->n_joints; i++)
        if (rig->places[i] >= 0)
            cdbo_set3(row + poses->at[CDBO_POSITIONS], (size_t)rig->places[i], cdbo_get3(rig->offsets, i));
}

/* How many numbers of room a character needs while it goes through the stages. */
static inline size_t cdbo_pose_room(const cdbo_poses *poses)
{
    return 4 * poses->rig.n_joints + 3 * poses->rig.n_feet + cdbo_seam_room(&poses->rig);
}

/* Whether a moment is one of the banks: the number of a bank from 0, and a range of it. */
static inline int cdbo_is_moment(const cdbo_poses *poses, double bank, double range)
{
    return bank >= 0.0 && bank < (double)poses->n_banks && range >= 0.0 && range < (double)poses->banks[(size_t)bank]->n_ranges;
}

typedef enum cdbo_part { CDBO_WHOLE, CDBO_UP_TO_GROUND, CDBO_FROM_GROUND } cdbo_part;

/* Enter the clip's frame of before, for the stages from the ground on. */
static inline void cdbo_enter_again(cdbo_posed *one)
{
    if (one->frames) cdbo_enter_frame(one, cdbo_frames_at(one->frames, (size_t)one->given->range, one->given->at_s));
}

/* Put one character through the stages; what it was given is checked before (cdbo_is_moment), `seams` are those of its crowd. */
static inline void cdbo_pose_one(cdbo_posed *one, const cdbo_seam *seams, double dt_s, double *room, cdbo_part part)
{
    const cdbo_poses *poses = one->poses;
    int is_on = *cdbo_was(one, CDBO_BEGUN) != 0.0;
    size_t i = part == CDBO_FROM_GROUND ? poses->n_before_ground : 0;
    size_t stop = part == CDBO_UP_TO_GROUND ? poses->n_before_ground : poses->n_stages;
    one->dt_s = is_on ? dt_s : 0.0;
    one->mode = one->given->root == one->given->root ? one->given->root : poses->settings[CDBO_ROOT];
    one->seams = is_on && one->given->seam >= 0.0 ? seams + 2 * (size_t)one->given->seam : NULL;
    one->frames = one->given->bank >= 0.0 ? poses->banks[(size_t)one->given->bank] : NULL;
    one->frame = 0;
    one->travel[0] = one->travel[1] = one->travel[2] = 0.0;
    one->world = room, one->free = room + 4 * poses->rig.n_joints, one->seam_poses = one->free + 3 * poses->rig.n_feet;
    if (one->seams && part != CDBO_FROM_GROUND) {
        cdbo_vector *velocity[2];
        size_t k;
        velocity[0] = &one->left, velocity[1] = &one->entered;
        for (k = 0; k < 2; k++) {
            const cdbo_seam *seam = one->seams + k;
            const cdbo_frames *bank = poses->banks[(size_t)seam->bank];
            *velocity[k] = cdbo_times(seam->rate, cdbo_root_velocity(bank, cdbo_frames_at(bank, (size_t)seam->range, seam->at_s)));
        }
    }
    if (part == CDBO_FROM_GROUND) cdbo_enter_again(one);
    for (; i < stop; i++) poses->stages[i]->run(one);
    if (part == CDBO_UP_TO_GROUND) cdbo_stand_free(one);
}
#include "receive.h"
