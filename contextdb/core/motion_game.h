/* The parts of the core for motion in games, behind those of motion.h. */
#include "bundle.h"
#include "event.h"
#include "joint_clips.h"
#include "character.h"
#include "match.h"
#include "together.h"
#include "crowd.h"
