#include "lights/measurement/colour_over_angle.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/colour/chromaticity.h"

namespace lucerna {
namespace {

bool has_colour(const V3d& xyz) {
    return xyz.y > 0 && std::isfinite(xyz.x + xyz.y + xyz.z);
}

// Joins the webs of X, Y and Z, which share one grid.
AngularColours joined_webs(const std::array<PhotometricWeb, 3>& webs, const V3d& flux) {
    AngularColours colours;
    const PhotometricGrid& grid = webs[1].grid();
    colours.polar = grid.polar;
    colours.azimuth.assign(grid.azimuth.begin(), grid.azimuth.end() - 1);  // 360 equals 0
    for (std::size_t j = 0; j < colours.azimuth.size(); ++j) {
        for (std::size_t i = 0; i < colours.polar.size(); ++i) {
            colours.xyz.emplace_back(double{webs[0].grid().at(j, i)}, double{grid.at(j, i)},
                                     double{webs[2].grid().at(j, i)});
        }
    }
    colours.mean = flux;
    return colours;
}

// Returns the colours of a web in one colour.
AngularColours of_one_colour(const PhotometricWeb& web, const V3d& xyz) {
    AngularColours colours = joined_webs({web, web, web}, web.flux() * xyz);
    for (V3d& at : colours.xyz) at = at.y * xyz;
    return colours;
}

std::string number(double value, int digits) {
    return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : std::string();
}

}  // namespace

double delta_uv(const V3d& xyz, const V3d& reference) {
    const Chromaticity a = chromaticity(xyz), b = chromaticity(reference);
    return hypot(a.u - b.u, a.v - b.v);
}

V3d AngularColours::over_planes(std::size_t polar_index) const {
    V3d sum(0, 0, 0);
    for (std::size_t j = 0; j < azimuth.size(); ++j) sum += at(j, polar_index);
    return sum / static_cast<double>(azimuth.size());  // a web has planes
}

double AngularColours::peak() const {
    double most = 0;
    for (const V3d& at : xyz) most = std::max(most, at.y);
    return most;
}

double AngularColours::largest_delta(double share) const {
    const double least = share * peak();
    double most = 0;
    for (const V3d& at : xyz)
        if (has_colour(at) && at.y >= least) most = std::max(most, delta_uv(at, mean));
    return most;
}

AngularColours colours_over_angle(const Lumigraph& lamp, const FarFieldGrid& grid, const Workers& workers,
                                  Monitor& monitor) {
    if (!lamp.coloured()) return of_one_colour(far_field(lamp, grid, workers, monitor), lamp.xyz());
    V3d flux;
    const auto web_of = [&](int c) {
        const Lumigraph channel = lamp.channel(c);
        flux[c] = channel.flux();
        return far_field(channel, grid, workers, monitor);
    };
    const PhotometricWeb x = web_of(0), y = web_of(1), z = web_of(2);
    return joined_webs({x, y, z}, flux);
}

AngularColours colours_over_angle(const RaySet& rays, const FarFieldGrid& grid) {
    if (!rays.coloured()) return of_one_colour(far_field(rays, grid), rays.xyz);
    // Colours are compared direction by direction, so all are averaged over the same caps.
    FarFieldGrid of_all = grid;
    if (!(of_all.cap > 0)) of_all.cap = smoothing_cap(rays, grid);
    V3d flux;
    const auto web_of = [&](int c) {
        const RaySet channel = rays.channel(c);
        flux[c] = channel.flux;
        return far_field(channel, of_all);
    };
    const PhotometricWeb x = web_of(0), y = web_of(1), z = web_of(2);
    return joined_webs({x, y, z}, flux);
}

std::string colours_csv(const AngularColours& colours, std::string_view title, std::string_view unit) {
    const Chromaticity mean = chromaticity(colours.mean);
    std::string csv = fmt::format("# {}: colour over angle\n", title);
    csv += fmt::format("# mean of all light: u' {:.5f}, v' {:.5f}\n", mean.u, mean.v);
    csv += fmt::format("gamma_deg,c_deg,intensity_{},x,y,u,v,delta_uv_axis,delta_uv_mean,cct_k,duv\n", unit);
    const V3d& axis = colours.on_axis();
    for (std::size_t j = 0; j < colours.azimuth.size(); ++j) {
        for (std::size_t i = 0; i < colours.polar.size(); ++i) {
            const V3d& xyz = colours.at(j, i);
            csv += fmt::format("{:g},{:g},{:.6g}", colours.polar[i], colours.azimuth[j], xyz.y);
            if (!has_colour(xyz)) {
                csv += ",,,,,,,,\n";
                continue;
            }
            const Chromaticity at = chromaticity(xyz);
            csv += fmt::format(",{:.5f},{:.5f},{:.5f},{:.5f},{},{:.5f}", at.x, at.y, at.u, at.v,
                               number(has_colour(axis) ? delta_uv(xyz, axis) : NAN, 5),
                               delta_uv(xyz, colours.mean));
            const auto temperature = colour_temperature(xyz);
            csv += temperature ? fmt::format(",{:.0f},{:.5f}\n", temperature->kelvin, temperature->duv)
                               : std::string(",,\n");
        }
    }
    return csv;
}

}  // namespace lucerna
