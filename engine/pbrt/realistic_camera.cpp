// Reads the camera of real lenses of versions 2 to 4 as the thin lens of its focal length and aperture.
//
// A lens table lists surfaces from the scene to the film: radius of curvature, distance to the next surface,
// refractive index behind it, diameter, with all lengths in mm; radius 0 marks the stop. A paraxial ray gives
// the focal length and the size of the entrance pupil (Hecht, Optics, 6.2).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "engine/base/elementary.h"
#include "engine/pbrt/state.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

constexpr double kMetre = 1e-3;  // per millimetre

struct LensSurface {
    double radius, thickness, eta, diameter;  // mm
};

std::vector<LensSurface> read_lens_table(const std::filesystem::path& file) {
    std::vector<LensSurface> surfaces;
    std::istringstream text(read_text(file));
    int line_number = 0;
    for (std::string line; std::getline(text, line);) {
        ++line_number;
        std::istringstream words(line.substr(0, line.find('#')));
        std::vector<double> n;
        for (double x = 0; words >> x;) n.push_back(x);
        if (words.eof() && n.size() == 4) {
            surfaces.push_back({n[0], n[1], n[2], n[3]});
        } else if (!words.eof() || n.size() > 1) {  // version 2's tables begin with a line of one number
            throw InputError({file.string(), line_number, 1},
                             "a lens surface needs radius, thickness, index and diameter");
        }
    }
    return surfaces;
}

struct Paraxial {
    double focal;        // mm
    double stop_radius;  // mm, of the stop in the table; 0: no stop
    double enlargement;  // size of the entrance pupil relative to the stop
};

Paraxial trace_paraxial(const std::vector<LensSurface>& surfaces) {
    Paraxial lens{0, 0, 1};
    double y = 1, slope = 0, n = 1;  // a ray parallel to the axis
    for (const LensSurface& s : surfaces) {
        if (s.radius == 0) {
            lens.stop_radius = s.diameter / 2;
            lens.enlargement = y > 0 ? 1 / y : 1;
        } else {
            const double behind = s.eta > 0 ? s.eta : 1;
            slope = (n * slope - y * (behind - n) / s.radius) / behind;
            n = behind;
        }
        y += s.thickness * slope;
    }
    lens.focal = -1 / slope;
    return lens;
}

// Version 2 gives the distance of the film, versions 3 and 4 that of the focus.
double film_distance(Params& params, double focal, double& focus) {
    for (const std::string_view name : {"filmdistance", "film_distance"}) {
        if (!params.has(name)) continue;
        const double distance = params.real_within(name, 50, 1e-3, 1e6) * kMetre;
        focus = distance > focal ? 1 / (1 / focal - 1 / distance) : 1e6;
        return distance;
    }
    focus = params.real_within("focusdistance", 10, 1e-6, 1e9);
    return focus > focal ? 1 / (1 / focal - 1 / focus) : focal;
}

}  // namespace

void read_realistic(Reading& reading, Params& params) {
    const std::string_view table = params.has("specfile") ? "specfile" : "lensfile";
    const std::string name = params.string(table, "");
    if (name.empty()) fail(params.place(), "{} lacks \"string lensfile\"", params.owner());
    Paraxial lens{};
    try {
        lens = trace_paraxial(read_lens_table(reading.resolve(name)));
    } catch (const InputError& error) {
        fail_always(params.place_of(table), "{}", printable(error.what()));
    }
    // A diverging or missing lens forms no image.
    if (!(lens.focal > 1e-3 && lens.focal < 1e6)) {
        fail(params.place_of(table), "\"{}\": the focal length is {:g} mm; expected 0.001 to 1e6",
             shown(name), lens.focal);
    }
    const std::string_view aperture =
        params.has("aperture_diameter") ? "aperture_diameter" : "aperturediameter";
    double radius = params.real_within(aperture, 1, 0, 1e6) / 2;
    if (lens.stop_radius > 0) radius = std::min(radius, lens.stop_radius);
    RealisticLens result;
    result.film_distance = film_distance(params, lens.focal * kMetre, result.focus_distance);
    result.radius = radius * lens.enlargement * kMetre;
    for (const std::string_view diagonal : {"filmdiag", "film_diag"}) {
        if (params.has(diagonal)) result.film_diagonal = params.real_within(diagonal, 35, 1e-3, 1e6) * kMetre;
    }
    result.weighted = !params.boolean("simpleweighting", true);
    params.accept({"aperture", "scale"});
    reading.draft.lens = result;
    params.warn_or_refuse(params.place(), params.owner() + " is not supported",
                          fmt::format("a thin lens of {:.4g} mm, {:.4g} mm wide, is used", lens.focal,
                                      2 * result.radius / kMetre),
                          "distortion, vignetting and the aperture's shape");
}

void settle_lens(Draft& draft) {
    if (!draft.lens) return;
    const RealisticLens& lens = *draft.lens;
    Camera::Settings& camera = draft.camera;
    const double diagonal = lens.film_diagonal > 0 ? lens.film_diagonal : draft.film_diagonal;
    const double w = draft.film.width, h = draft.film.height;
    const double side = diagonal * std::min(w, h) / hypot(w, h);
    camera.kind = Camera::Settings::Kind::perspective;
    camera.fov_degrees = static_cast<float>(
        std::clamp(2 * atan(side / 2 / lens.film_distance) * 180 / M_PI, 1e-3, 179.0));
    camera.lens_radius = static_cast<float>(lens.radius);
    camera.focal_distance = static_cast<float>(lens.focus_distance);
    // The film receives L π (r/d)² on the axis; version 4 always measures this.
    const double ratio = lens.radius / lens.film_distance;
    if (lens.weighted || draft.film_of_version4) draft.film.scale *= static_cast<float>(M_PI * ratio * ratio);
}

}  // namespace lucerna
