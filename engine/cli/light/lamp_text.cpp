#include "engine/cli/light/lamp_text.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/base/elementary.h"
#include "engine/colour/chromaticity.h"
#include "engine/text/plain_text.h"
#include "engine/text/units.h"
#include "lights/cell_table.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/spectral_lamp.h"

namespace lucerna {
namespace {

// Formats "12.3 %" of a whole, which may be 0.
std::string percent(double part, double whole) {
    return whole > 0 ? fmt::format("{:.3g} %", 100 * part / whole) : std::string("-");
}

struct Negative {
    float peak = 0;         // the largest coefficient
    std::size_t count = 0;  // negative coefficients
    double sum = 0;         // their sum
};

Negative negatives(const LightField& field) {
    Negative found;
    for (const float e : field.coefficients()) {
        found.peak = std::max(found.peak, e);
        if (e < 0) {
            ++found.count;
            found.sum += double{e};
        }
    }
    return found;
}

// Describes where even steps in a plane's coordinate are even on the plane.
std::string evenness(const PlaneCoordinate& coordinate) {
    return coordinate.c > 0 ? fmt::format(" in the middle (about even in angle as seen from {})",
                                          length_text(coordinate.c))
                            : std::string();
}

void print_rig(std::ostream& out, const Rig& rig) {
    fmt::print(out, "sampling plane S     {} x {} views, {} x {} apart{}, centre ({}, {}, {})\n", rig.views.x,
               rig.views.y, length_text(rig.spacing.x), length_text(rig.spacing.y),
               evenness(rig.s_coordinate), length_text(double{rig.centre.x}),
               length_text(double{rig.centre.y}), length_text(double{rig.centre.z}));
    fmt::print(out, "measurement plane M  {} x {} pixels of {} x {}{}, {} from S; {}\n", rig.pixels.x,
               rig.pixels.y, length_text(rig.pixel.x), length_text(rig.pixel.y), evenness(rig.m_coordinate),
               length_text(rig.distance), rig.basis == PixelBasis::hat ? "linear between them" : "each even");
    if (rig.filter_basis == FilterBasis::hat)
        fmt::print(out, "between views        linear: measured without an optical filter\n");
    // D > 0 in every accepted rig. Angles are from the centre of S, without the sensor's travel.
    const auto angle = [&rig](int axis) {
        return atan(-rig.m_coordinate.on_plane((-0.5 * rig.pixels[axis] - rig.overhang()) * rig.pixel[axis]) /
                    rig.distance);
    };
    fmt::print(out, "angles               +-{:.1f} x +-{:.1f} degrees from the middle of S; {}\n",
               angle(0) * 180 / double{kPi}, angle(1) * 180 / double{kPi},
               rig.shift == V2i(0, 0) ? std::string("Setup B, the screen stands still")
                                      : fmt::format("Setup A, the sensor moves by {} x {} pixels per view",
                                                    rig.shift.x, rig.shift.y));
}

// Formats a flux of a file's header, where 0 or NaN means "not stated".
std::string stated(double flux, std::string_view unit) {
    return flux > 0 && std::isfinite(flux) ? fmt::format("{:g} {}", flux, unit) : fmt::format("no {}", unit);
}

void print_chromaticity(std::ostream& out, const V3d& xyz) {
    const Chromaticity c = chromaticity(xyz);
    fmt::print(out, "chromaticity         x {:.4f}, y {:.4f}; u' {:.4f}, v' {:.4f}\n", c.x, c.y, c.u, c.v);
    const std::optional<ColourTemperature> t = colour_temperature(xyz);
    if (t) {
        fmt::print(out, "colour temperature   {:.0f} K, Duv {:+.4f}\n", t->kelvin,
                   std::fabs(t->duv) < 0.5e-4 ? 0.0 : t->duv);  // avoids -0.0000
    } else {
        fmt::print(
            out, "colour temperature   no CCT: farther than {:g} from the Planckian locus, {:g} to {:g} K\n",
            kMostDuv, kLeastKelvin, kMostKelvin);
    }
}

// The bounding box of the rays' origins and their mean direction, weighted by flux.
struct RayBundle {
    Imath::Box<V3f> box;
    V3d direction{0, 0, 0};
    double sum = 0, backward = 0;
    std::uint64_t backward_rays = 0;
};

RayBundle bundle(const RaySet& set) {
    RayBundle b;
    for (const LampRay& ray : set.rays) {
        b.box.extendBy(ray.o);
        b.direction += V3d(ray.d) * double{ray.flux};
        b.sum += double{ray.flux};
        if (ray.d.z <= 0) {
            b.backward += double{ray.flux};
            ++b.backward_rays;
        }
    }
    if (b.sum > 0) b.direction /= b.sum;
    return b;
}

// Prints what is known of the light's spectrum, of which the parts have these shares of the luminous flux.
void print_spectra(std::ostream& out, const Lumigraph& lamp) {
    const SpectralBasis& basis = lamp.slabs()[0].field.info().spectra;
    const auto known = [](const Slab& slab) { return slab.field.info().spectra.known(); };
    if (!std::ranges::all_of(lamp.slabs(), known)) return;
    fmt::print(out, "spectra              {}{}\n", basis.spectra.size(),
               basis.error > 0
                   ? fmt::format(", of which all light is a mixture but for {:.2g} %", 100 * basis.error)
                   : std::string());
    BandSpectrum all;
    for (const SpectralLamp& part : spectral_lamps(lamp)) all += part.lamp.flux() * part.spectrum;
    if (const auto rendition = colour_rendition(all)) {
        fmt::print(out, "colour rendition     R_a {:.1f}, R_9 {:.1f}; R_f {:.1f}, R_g {:.1f}\n",
                   rendition->general, rendition->r9(), rendition->fidelity, rendition->gamut);
    }
    fmt::print(out, "melanopic DER        {:.4g}\n", melanopic_edi(all) / band_lumens(all));
}

void print_light_field(std::ostream& out, const LightField& field, const Workers& workers) {
    const LightFieldInfo& info = field.info();
    const std::string_view unit = flux_unit_name(info.unit);
    const double flux = field.flux();
    const double lamp = info.captured + info.missed;
    const Negative negative = negatives(field);
    const double count = static_cast<double>(field.coefficients().size());  // at least 1
    print_rig(out, field.rig());
    fmt::print(out, "flux                 {:.6g} {}\n", flux, unit);
    fmt::print(out, "captured, missed     {:.6g} {} ({}), {:.6g} {} ({}) of the lamp's flux\n", info.captured,
               unit, percent(info.captured, lamp), info.missed, unit, percent(info.missed, lamp));
    fmt::print(out, "peak coefficient     {:.6g} {}/m^4\n", negative.peak, unit);
    if (negative.count > 0) {
        // The emission is max(0, h), scaled back to the measured flux.
        const double below = -negative.sum * field.rig().cell_volume();
        fmt::print(
            out,
            "negative             {} of {} coefficients ({}), which sum to {} of the flux; clamping adds "
            "{}, and emission is scaled to compensate\n",
            negative.count, field.coefficients().size(), percent(static_cast<double>(negative.count), count),
            percent(below, flux), percent(field.clamped_flux(workers) - flux, flux));
    }
    print_chromaticity(out, field.xyz());
    fmt::print(out, "colours              {}\n",
               field.coloured() ? "varying with position and direction" : "one for all light");
    print_spectra(out, Lumigraph(field));
    if (info.lumens_per_watt > 0)
        fmt::print(out, "luminous efficacy    {:.4g} lm/W of radiation\n", info.lumens_per_watt);
    if (!info.errors.empty()) print_errors(out, info.errors);
    const double bytes = sizeof(float) + (field.coloured() ? sizeof(ColourChannels::Pair) : 0);
    fmt::print(out, "memory               {:.1f} MB of coefficients, {:.1f} MB of sampling table\n",
               1e-6 * bytes * count, 1e-6 * static_cast<double>(CellTable::bytes_for(field.rig())));
    fmt::print(out, "content hash         {:016x}\n", content_hash(field));
    if (!info.provenance.empty()) fmt::print(out, "provenance           {}\n", info.provenance);
}

// Prints the planes and the content of one of several slabs.
void print_slab(std::ostream& out, const Slab& slab, double lamp_flux, const Workers& workers) {
    const std::string_view unit = flux_unit_name(slab.field.info().unit);
    const double flux = slab.field.flux();
    const V3d centre = slab.axes.to_lamp(slab.field.rig().centre);
    fmt::print(out, "\nslab                 light towards {}; centre of S in the lamp's frame ({}, {}, {})\n",
               slab.axes.name(), length_text(centre.x), length_text(centre.y), length_text(centre.z));
    print_rig(out, slab.field.rig());
    fmt::print(out, "flux                 {:.6g} {}, {} of the lamp's", flux, unit, percent(flux, lamp_flux));
    if (negatives(slab.field).count > 0) {
        fmt::print(out, " (clamping negative values adds {})",
                   percent(slab.field.clamped_flux(workers) - flux, flux));
    }
    fmt::print(out, "\n");
}

}  // namespace

void print_lumigraph(std::ostream& out, const Lumigraph& lamp, const Workers& workers) {
    if (lamp.simple()) return print_light_field(out, lamp.slabs()[0].field, workers);
    const std::string_view unit = flux_unit_name(lamp.unit());
    const double flux = lamp.flux(), whole = lamp.captured() + lamp.missed();
    std::string names;
    double bytes = 0, table_bytes = 0;
    for (const Slab& slab : lamp.slabs()) {
        names += (names.empty() ? "" : ", ") + slab.axes.name();
        const double each = sizeof(float) + (slab.field.coloured() ? sizeof(ColourChannels::Pair) : 0);
        bytes += each * static_cast<double>(slab.field.coefficients().size());
        table_bytes += static_cast<double>(CellTable::bytes_for(slab.field.rig()));
    }
    const Box3d& box = lamp.box();
    fmt::print(out, "slabs                {}: {}\n", lamp.slabs().size(), names);
    fmt::print(out, "box of the lamp      x {} to {}, y {} to {}, z {} to {}\n", length_text(box.min.x),
               length_text(box.max.x), length_text(box.min.y), length_text(box.max.y), length_text(box.min.z),
               length_text(box.max.z));
    fmt::print(out, "flux                 {:.6g} {}\n", flux, unit);
    fmt::print(out, "captured, missed     {:.6g} {} ({}), {:.6g} {} ({}) of the lamp's flux\n",
               lamp.captured(), unit, percent(lamp.captured(), whole), lamp.missed(), unit,
               percent(lamp.missed(), whole));
    print_chromaticity(out, lamp.xyz());
    fmt::print(out, "colours              {}\n",
               lamp.coloured() ? "varying with position and direction" : "one for all light");
    print_spectra(out, lamp);
    fmt::print(out, "memory               {:.1f} MB of coefficients, {:.1f} MB of sampling table\n",
               1e-6 * bytes, 1e-6 * table_bytes);
    fmt::print(out, "content hash         {:016x}\n", content_hash(lamp));
    if (!lamp.provenance().empty()) fmt::print(out, "provenance           {}\n", lamp.provenance());
    for (const Slab& slab : lamp.slabs()) print_slab(out, slab, flux, workers);
}

void print_ray_set(std::ostream& out, const RaySet& set) {
    const RayBundle b = bundle(set);
    const std::string_view unit = flux_unit_name(set.unit);
    fmt::print(out, "rays                 {}\n", set.rays.size());
    fmt::print(out, "flux                 {:.6g} {} (file states {}, {})\n", set.flux, unit,
               stated(set.header_lumens, "lm"), stated(set.header_watts, "W"));
    fmt::print(out, "skipped              {} not finite, {} without direction ({:.6g} {})\n", set.skipped_nan,
               set.skipped_zero_direction, set.skipped_flux, unit);
    if (!set.rays.empty()) {
        fmt::print(out, "start                x {} to {}, y {} to {}, z {} to {}\n",
                   length_text(double{b.box.min.x}), length_text(double{b.box.max.x}),
                   length_text(double{b.box.min.y}), length_text(double{b.box.max.y}),
                   length_text(double{b.box.min.z}), length_text(double{b.box.max.z}));
        fmt::print(out, "mean direction       ({:.5f}, {:.5f}, {:.5f})\n", b.direction.x, b.direction.y,
                   b.direction.z);
        fmt::print(out, "backward (z <= 0)    {} rays, {} of the flux\n", b.backward_rays,
                   percent(b.backward, b.sum));
    }
    const Rgb colour = set.colour();
    fmt::print(out, "colour               {:.4f} {:.4f} {:.4f}{}\n", colour.x, colour.y, colour.z,
               set.coloured() ? ", each ray with its own" : "");
    print_chromaticity(out, set.xyz);
    if (set.lumens_per_watt > 0)
        fmt::print(out, "luminous efficacy    {:.4g} lm/W of radiation\n", set.lumens_per_watt);
    if (!set.provenance.empty()) fmt::print(out, "provenance           {}\n", set.provenance);
}

void print_beam(std::ostream& out, const PhotometricWeb& web, FluxUnit unit) {
    const Beam beam = beam_of(web);
    const V3d& d = beam.brightest;
    fmt::print(out, "peak intensity       {:.4g} {} towards ({:.3f}, {:.3f}, {:.3f})\n", beam.peak,
               unit == FluxUnit::lumen ? "cd" : "W/sr", d.x + 0.0, d.y + 0.0, d.z + 0.0);
    const auto line = [&](std::string_view name, std::string_view share, const std::array<double, 2>& angle) {
        const auto text = [](double degrees) {
            return degrees > 0 ? fmt::format("{:.1f} degrees", degrees) : std::string("none");
        };
        fmt::print(out, "{:<20} {} in C0-C180, {} in C90-C270, to {} of the peak\n", name, text(angle[0]),
                   text(angle[1]), share);
    };
    line("beam angle", "50 %", beam.beam_angle);
    line("field angle", "10 %", beam.field_angle);
}

void print_beam(std::ostream& out, const RaySet& set) {
    const PhotometricWeb web = far_field(set, {});
    print_beam(out, web, set.unit);
    fmt::print(out, "smoothed over        caps of {:g} degrees around each direction\n", web.info().smoothed);
}

void print_errors(std::ostream& out, std::span<const PlaneError> errors) {
    if (errors.empty()) {
        fmt::print(out, "error of irradiance  not known: too few rays\n");
        return;
    }
    fmt::print(out,
               "error of irradiance  on planes at a distance from S, by the light field; by counting the "
               "rays there\n");
    for (const PlaneError& e : errors) {
        const std::string where = std::isinf(e.distance) ? "by direction" : length_text(e.distance);
        const std::string error = !(e.counts > 0)    ? "too few rays to measure"
                                  : !(e.squared > 0) ? "too small to measure"  // below what the rays resolve
                                                     : fmt::format("{:.1f} %", 100 * e.relative());
        fmt::print(out, "  {:<18} {:<18} {:.1f} %\n", where, error, 100 * e.counts);
    }
}

void print_account(std::ostream& out, const FluxAccount& account, FluxUnit unit) {
    const std::string_view name = flux_unit_name(unit);
    const auto line = [&](std::string_view what, double flux) {
        fmt::print(out, "  {:<34} {:>12.6g} {} {:>10}\n", what, flux, name, percent(flux, account.total));
    };
    fmt::print(out, "distribution of the rays' flux:\n");
    line("captured by the light field", account.captured);
    line("beside S", account.beside_s);
    line("beside M", account.beside_m);
    line("backward", account.backward);
    line("unusable rays", account.skipped);
    line("between filters (signed)", account.not_in_basis);
    line("all", account.total);
}

namespace {

std::string angles_text(const std::vector<double>& angles, std::string_view name) {
    return fmt::format("{} {} from {:g} to {:g}", angles.size(), name, angles.front(), angles.back());
}

std::string opening_text(const LuminousOpening& opening) {
    const auto& sides = opening.side_heights;
    const std::string across =
        fmt::format("{} along C0, {} along C90", length_text(opening.size.x), length_text(opening.size.y));
    if (std::all_of(sides.begin(), sides.end(), [&sides](double height) { return height == sides[0]; }))
        return fmt::format("{}, {} high ({})", across, length_text(opening.size.z), opening.name());
    return fmt::format("{}, {}, {}, {} and {} high towards C0, C90, C180 and C270 ({})", across,
                       length_text(sides[0]), length_text(sides[1]), length_text(sides[2]),
                       length_text(sides[3]), opening.name());
}

}  // namespace

void print_photometric(std::ostream& out, const PhotometricWeb& web, FluxUnit unit) {
    const PhotometricInfo& info = web.info();
    const PhotometricGrid& grid = web.grid();
    constexpr const char* kPolar[] = {"gamma angles", "90 + H angles", "90 + V angles"};
    constexpr const char* kAzimuth[] = {"C planes", "B planes", "A planes"};
    const auto type = static_cast<std::size_t>(grid.planes);
    fmt::print(out, "flux                 {:.6g} {}", web.flux(), flux_unit_name(unit));
    if (info.lamp_lumens > 0) {
        fmt::print(out, " of {:g} lm of the lamps ({:.1f} %)", info.lamp_lumens,
                   100 * web.flux() / info.lamp_lumens);
    }
    fmt::print(out, "\n");
    print_beam(out, web, unit);
    fmt::print(out, "grid                 {}; {}\n", angles_text(grid.polar, kPolar[type]),
               angles_text(grid.azimuth, kAzimuth[type]));
    const bool from_opening = info.opening.faces().second > 0;
    if (info.opening.size != V3d(0, 0, 0))
        fmt::print(out, "luminous opening     {}\n", opening_text(info.opening));
    fmt::print(out, "shines from          {}\n", from_opening ? "its luminous opening" : "a point");
    if (info.watts > 0) {
        fmt::print(out, "input                {:g} W ({:.4g} lm/W)\n", info.watts, web.flux() / info.watts);
    }
    for (const auto& [key, value] : info.keywords) {
        if (!key.empty() && !value.empty()) fmt::print(out, "{:<20} {}\n", one_line(key), one_line(value));
    }
    if (!info.provenance.empty()) fmt::print(out, "provenance           {}\n", info.provenance);
}

void print_fit(std::ostream& out, const LumigraphFit& made) {
    const FluxUnit unit = made.lamp.unit();
    print_account(out, made.account, unit);
    if (made.lamp.simple()) return;  // its description has the errors
    for (std::size_t i = 0; i < made.slabs.size(); ++i) {
        const FluxAccount& slab = made.slabs[i];
        fmt::print(out, "slab {}: share {:.6g} {}, of which {:.6g} {} captured\n",
                   made.lamp.slabs()[i].axes.name(), slab.total, flux_unit_name(unit), slab.captured,
                   flux_unit_name(unit));
        print_errors(out, made.lamp.slabs()[i].field.info().errors);
    }
}

}  // namespace lucerna
