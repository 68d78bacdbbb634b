#include "engine/cli/photometric_text.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <cmath>

#include "engine/base/files.h"
#include "engine/base/units.h"

namespace lucerna {
namespace {

std::string angles_text(const std::vector<double>& angles, std::string_view name) {
    return fmt::format("{} {} from {:g} to {:g}", angles.size(), name, angles.front(), angles.back());
}

// Where the brightest value of the grid lies.
std::pair<double, double> brightest(const PhotometricGrid& grid) {
    const auto most = std::max_element(grid.candela.begin(), grid.candela.end()) - grid.candela.begin();
    const auto angles = static_cast<std::ptrdiff_t>(grid.polar.size());
    return {grid.polar[static_cast<std::size_t>(most % angles)],
            grid.azimuth[static_cast<std::size_t>(most / angles)]};
}

}  // namespace

void print_photometric(std::ostream& out, const PhotometricWeb& web, FluxUnit unit) {
    const PhotometricInfo& info = web.info();
    const PhotometricGrid& grid = web.grid();
    const std::string_view intensity = unit == FluxUnit::lumen ? "cd" : "W/sr";
    constexpr const char* kPolar[] = {"gamma angles", "90 + H angles", "90 + V angles"};
    constexpr const char* kAzimuth[] = {"C planes", "B planes", "A planes"};
    const auto type = static_cast<std::size_t>(grid.planes);
    fmt::print(out, "flux                 {:.6g} {}", web.flux(), flux_unit_name(unit));
    if (info.lamp_lumens > 0) {
        fmt::print(out, " of {:g} lm of the lamps ({:.1f} %)", info.lamp_lumens,
                   100 * web.flux() / info.lamp_lumens);
    }
    const auto [polar, azimuth] = brightest(grid);
    fmt::print(out, "\npeak                 {:.6g} {} at {:g}, plane {:g}\n", web.peak(), intensity, polar,
               azimuth);
    fmt::print(out, "grid                 {}; {}\n", angles_text(grid.polar, kPolar[type]),
               angles_text(grid.azimuth, kAzimuth[type]));
    if (info.opening != V3d(0, 0, 0)) {
        fmt::print(out, "luminous opening     {}{} along C0, {} along C90, {} high\n",
                   info.round_opening ? "round, " : "", length_text(info.opening.x),
                   length_text(info.opening.y), length_text(info.opening.z));
    }
    if (info.watts > 0) {
        fmt::print(out, "input                {:g} W ({:.4g} lm/W)\n", info.watts, web.flux() / info.watts);
    }
    for (const auto& [key, value] : info.keywords) {
        if (!key.empty() && !value.empty()) fmt::print(out, "{:<20} {}\n", one_line(key), one_line(value));
    }
    if (!info.provenance.empty()) fmt::print(out, "provenance           {}\n", info.provenance);
}

}  // namespace lucerna
