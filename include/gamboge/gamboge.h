/* Public: the whole interface. */
#ifndef GAMBOGE_H
#define GAMBOGE_H

#include "analysis.h"
#include "context.h"
#include "engine.h"
#include "kernels.h"
#include "neighbours.h"
#include "scene.h"
#include "status.h"
#include "sum.h"
#include "trajectory.h"
#include "version.h"

#endif
