// Colours of all spellings, brought to linear sRGB.
#include "engine/pbrt/state.h"

namespace lucerna {

std::optional<Rgb> read_spectrum(Reading& /*reading*/, Params& params, std::string_view name,
                                 ColorUse /*use*/) {
    const Param* param = params.find(name, {Param::Type::rgb});
    if (!param) return std::nullopt;
    return to_rgb(*param);
}

}  // namespace lucerna
