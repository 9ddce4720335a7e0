/* Jumplink: filters for systems that jump between models, on processing
 * elements joined by links.
 *
 * This header brings every topic; each can also be included by itself.
 *
 * What holds everywhere:
 *   memory    Nothing is allocated.  An object is bound by its init to an array
 *             of yours, whose size a macro gives as a constant expression; the
 *             array outlives the object.  Scratch is separate, means nothing
 *             between calls, and may be shared by the filters of a thread.
 *   shapes    [n,m] is a row-major array of n rows; covariances are full square
 *             arrays, exactly symmetric.
 *   aliasing  Arrays of one call do not overlap unless it says that they may.
 *   errors    0, or a negative code of base.h; after a failure the object is as
 *             before.  Sizes, symmetry and the like are checked once, by init
 *             and set; a step reports only what data can cause.
 *   threads   No changing globals: objects that share no memory may be used by
 *             different threads at once.
 *   units     seconds, radians, metres, unless a name says otherwise.
 *   numbers   jl_real is double or float (config.h), for the library and its
 *             users alike.  The same bits on every machine with IEEE numbers.
 */
#ifndef JUMPLINK_H
#define JUMPLINK_H

#define JL_VERSION_MAJOR 0
#define JL_VERSION_MINOR 1

#include "jumplink/config.h"
#include "jumplink/base.h"
#include "jumplink/mat.h"
#include "jumplink/model.h"
#include "jumplink/kf.h"
#include "jumplink/imm.h"
#include "jumplink/cgimm.h"
#include "jumplink/mekf.h"
#include "jumplink/systolic.h"
#include "jumplink/chan.h"
#include "jumplink/wire.h"
#include "jumplink/link.h"
#include "jumplink/plan.h"
#include "jumplink/par.h"
#include "jumplink/fold.h"

#endif
