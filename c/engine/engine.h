/* L2: the engine's body. Side rooms read it through view.h only. */
#ifndef GBG_ENGINE_ENGINE_H
#define GBG_ENGINE_ENGINE_H

#include "backend/backend.h"
#include "core/context.h"
#include "engine/view.h"
#include "gamboge/engine.h"
#include "scene/scene.h"

#endif
