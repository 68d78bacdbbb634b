// The scene of a report: its rooms, its luminaires and the lines of its plans.
#pragma once

#include "engine/cli/photometry/lux_page.h"

namespace lucerna {

// Returns a page that describes the scene, as far as the command draws plans or writes a page. Reads the
// lamps' files, and throws as that does.
LuxPage described(const LuxCommand& command, const RoomSurfaces& room, const Job& job, Monitor& monitor);

}  // namespace lucerna
