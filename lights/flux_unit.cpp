#include "lights/flux_unit.h"

#include <fmt/format.h>

namespace lucerna {

double unit_factor(const LampUnit& unit, FluxUnit own, double efficacy_of_file, const Location& at) {
    const FluxUnit wanted = unit.taken(own);
    if (wanted == own) return 1;
    const double efficacy = unit.efficacy > 0 ? unit.efficacy : efficacy_of_file;
    if (!(efficacy > 0)) {
        input_error(at,
                    "the lamp is measured in {} and the scene's unit is {} (its light is in {}); give "
                    "\"float efficacy\", the lamp's lm/W, or \"float power\" in {}",
                    flux_unit_name(own), unit_name(wanted), flux_unit_name(wanted), flux_unit_name(wanted));
    }
    return wanted == FluxUnit::lumen ? efficacy : 1 / efficacy;
}

}  // namespace lucerna
