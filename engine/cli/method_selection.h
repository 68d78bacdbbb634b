// What --time and --error without a method stand for.
#pragma once

#include <optional>

#include "engine/base/monitor.h"
#include "engine/render/method_choice.h"
#include "engine/render/render.h"

namespace lucerna {

// Puts the method whose estimated error is least within the options' limits into the job, and says which it
// is, as options that give it again, and the estimates of the others; leaves the part of the error that is
// noise's as its limit. None, and nothing changed, where no other method shows the same picture or the user
// stopped it.
std::optional<MethodChoice> select_method(Job& job, RenderOptions& options, Monitor& monitor);

}  // namespace lucerna
