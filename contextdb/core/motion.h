/* The parts of the core for motion, in the order in which each needs those before it. */
#include "room.h"
#include "row_play.h"
#include "lanes.h"
#include "frame_boxes.h"
#include "search.h"
#include "joint.h"
#include "controller.h"
#include "walk.h"
