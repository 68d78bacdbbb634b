// Bindings of measured lamps: light fields, ray files imported as light fields, photometric webs.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "engine/base/error.h"
#include "lights/lumigraph.h"
#include "lights/measurement/join_sides.h"
#include "lights/measurement/lumigraph_fit.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/photometric_files.h"
#include "lights/ray_set.h"
#include "python/bindings/arrays.h"
#include "python/bindings/bindings.h"
#include "python/bindings/python_monitor.h"

namespace lucerna {
namespace {

namespace py = pybind11;

using Pair = std::array<double, 2>;

// Lamps are immutable in Python.
using Lamp = std::shared_ptr<Lumigraph>;

Lamp lamp_of(Lumigraph made) {
    return std::make_shared<Lumigraph>(std::move(made));
}

const LightField& only_field(const Lumigraph& lamp, const char* what) {
    if (lamp.slabs().size() == 1) return lamp.slabs()[0].field;
    throw InputError({what},
                     fmt::format("the lamp has {} slabs; use this on each of .slabs", lamp.slabs().size()));
}

std::vector<py::ssize_t> shape_of(const Rig& rig) {
    return {rig.views.x, rig.views.y, rig.pixels.x, rig.pixels.y};
}

// Returns (views u, views v, pixels s, pixels t) or, for several colours, (..., 3): X, Y, Z.
py::array_t<float> coefficients_of(const Lumigraph& lamp) {
    const LightField& field = only_field(lamp, "array");
    std::vector<py::ssize_t> shape = shape_of(field.rig());
    if (!field.coloured()) return array_of<float>(field.coefficients(), shape);
    shape.push_back(3);
    py::array_t<float> array(shape);
    for (int c = 0; c < 3; ++c) {
        const LightField channel = field.channel(c);
        float* to = array.mutable_data() + c;
        for (const float value : channel.coefficients()) *to = value, to += 3;
    }
    return array;
}

// Returns the field with what a file would hold of it, so that an array equals the same array read back.
LightField field_of(const Rig& rig, const InputArray<float>& array, LightFieldInfo info,
                    const std::optional<V3d>& weight) {
    const std::vector<py::ssize_t> one = shape_of(rig);
    const auto is = [&](py::ssize_t channels) {
        if (array.ndim() != (channels == 1 ? 4 : 5)) return false;
        for (py::ssize_t i = 0; i < 4; ++i) {
            if (array.shape(i) != one[static_cast<std::size_t>(i)]) return false;
        }
        return channels == 1 || array.shape(4) == channels;
    };
    const std::span<const float> values = values_of(array);
    if (is(1)) return LightField(rig, std::vector<float>(values.begin(), values.end()), std::move(info));
    if (!is(3)) {
        throw InputError({"array"}, fmt::format("shape {} is not accepted; expected ({}, {}, {}, {}), or the "
                                                "same followed by 3 channels, X, Y and Z",
                                                shape_text(array), one[0], one[1], one[2], one[3]));
    }
    std::array<std::vector<float>, 3> xyz;
    for (std::vector<float>& channel : xyz) channel.reserve(values.size() / 3);
    for (std::size_t i = 0; i < values.size(); ++i) xyz[i % 3].push_back(values[i]);
    return LightField(rig, xyz[0], xyz[1], xyz[2], std::move(info), weight);
}

Lamp with_array(const Lumigraph& lamp, const InputArray<float>& array) {
    const LightField& old = only_field(lamp, "with_array");
    LightFieldInfo info = old.info();
    info.missed = 0;
    std::optional<V3d> weight;
    if (old.coloured() && array.ndim() == 5) weight = old.colour_channels().weight;
    LightField field = field_of(old.rig(), array, info, weight);
    info = field.info();
    info.captured = field.flux();
    field = std::move(field).with(info);
    if (lamp.simple()) return lamp_of(Lumigraph(std::move(field)));
    return lamp_of(Lumigraph({Slab{lamp.slabs()[0].axes, std::move(field)}}, lamp.box()));
}

FluxUnit unit_of(const std::string& word) {
    for (const FluxUnit unit : {FluxUnit::watt, FluxUnit::lumen}) {
        if (flux_unit_name(unit) == word) return unit;
    }
    throw InputError({"unit"}, fmt::format("\"{}\" is not accepted; expected \"W\" or \"lm\"", word));
}

Lamp made_lamp(const InputArray<float>& array, const Pair& spacing, const Pair& pixel, double distance,
               const std::string& unit, const std::array<double, 3>& centre, const std::string& provenance,
               const std::string& basis) {
    if (array.ndim() != 4 && array.ndim() != 5) {
        throw InputError({"array"},
                         fmt::format("shape {} is not accepted; expected (views u, views v, pixels s, pixels "
                                     "t), or the same followed by 3 channels, X, Y and Z",
                                     shape_text(array)));
    }
    constexpr py::ssize_t kMost = 1 << 20;
    for (py::ssize_t i = 0; i < 4; ++i) {
        if (array.shape(i) < 1 || array.shape(i) > kMost)
            throw InputError({"array"}, fmt::format("shape {} is not accepted", shape_text(array)));
    }
    const auto side = [&](py::ssize_t i) { return static_cast<int>(array.shape(i)); };
    Rig rig;
    rig.views = {side(0), side(1)};
    rig.pixels = {side(2), side(3)};
    rig.spacing = {spacing[0], spacing[1]};
    rig.pixel = {pixel[0], pixel[1]};
    rig.distance = distance;
    rig.centre = {centre[0], centre[1], centre[2]};
    if (basis != "box" && basis != "hat")
        throw InputError({"basis"},
                         fmt::format("\"{}\" is not accepted; expected \"box\" or \"hat\"", basis));
    rig.basis = basis == "hat" ? PixelBasis::hat : PixelBasis::box;
    LightFieldInfo info;
    info.unit = unit_of(unit);
    info.provenance = provenance;
    LightField field = field_of(rig, array, info, {});
    info = field.info();
    info.captured = field.flux();
    return lamp_of(Lumigraph(std::move(field).with(info)));
}

std::vector<Lamp> slabs_of(const Lumigraph& lamp) {
    std::vector<Lamp> slabs;
    for (const Slab& slab : lamp.slabs())
        slabs.push_back(lamp.slabs().size() == 1 ? lamp_of(lamp) : lamp_of(Lumigraph({slab}, lamp.box())));
    return slabs;
}

Lamp import_lamp(const std::vector<std::filesystem::path>& files, const std::vector<double>& drives,
                 const std::optional<std::array<int, 2>>& views,
                 const std::optional<std::array<int, 2>>& pixels, const std::optional<double>& distance,
                 double capture, int slabs, const std::optional<double>& height,
                 const std::optional<int>& threads, const py::object& progress) {
    if (files.empty()) throw InputError({"files"}, "is empty; expected one or more ray files");
    if (!drives.empty() && drives.size() != files.size()) {
        throw InputError({"drive"}, fmt::format("{} values for {} ray files; expected one for each file",
                                                drives.size(), files.size()));
    }
    if (slabs != 0 && slabs != 1 && slabs != 2 && slabs != 6)
        throw InputError({"slabs"}, fmt::format("{} is not accepted; expected 1, 2 or 6", slabs));
    if (height && slabs > 1) throw InputError({"height"}, "applies to one slab only; add slabs=1");
    if (!(capture > 0 && capture < 1))
        throw InputError({"capture"},
                         fmt::format("{:g} is not accepted; expected a share between 0 and 1", capture));
    const auto size = [](const char* name, const std::optional<std::array<int, 2>>& given) {
        if (!given) return V2i(0, 0);
        if ((*given)[0] < 1 || (*given)[1] < 1)
            throw InputError({name}, fmt::format("({}, {}) is not accepted; expected 1 or more", (*given)[0],
                                                 (*given)[1]));
        return V2i((*given)[0], (*given)[1]);
    };
    LumigraphOptions options;
    options.fit.views = size("views", views);
    options.fit.pixels = size("pixels", pixels);
    if (distance && !(*distance > 0))
        throw InputError({"distance"},
                         fmt::format("{:g} is not accepted; expected metres above 0", *distance));
    options.fit.distance = distance.value_or(0);
    options.fit.capture = capture;
    options.fit.z = height;
    options.slabs = slabs;
    const Workers workers = workers_of(threads);
    PythonMonitor monitor(progress);
    return monitor.run([&] {
        std::vector<DrivenRays> parts;
        for (std::size_t i = 0; i < files.size(); ++i)
            parts.push_back(
                {read_rays(files[i], monitor), files[i].string(), drives.empty() ? 1 : drives[i]});
        const RaySet rays =
            parts.size() == 1 && drives.empty() ? std::move(parts[0].set) : join_rays(std::move(parts));
        return lamp_of(fit_lumigraph(rays, options, workers, monitor).lamp);
    });
}

// Irradiance on a plane perpendicular to the normal of a side. Distances have the command's origin: S of a
// plain light field, the centre of the box of any other lamp.
struct Screen {
    const Lumigraph& lamp;
    SlabAxes side;

    bool plain() const { return lamp.simple() && side.straight(); }
    // Throws InputError for a plane behind the lamp's S.
    void require_before_lamp(double distance) const {
        if (!plain() || distance >= 0) return;
        throw InputError(
            {"distance"},
            fmt::format("{:g} m is not accepted: it lies behind the lamp's sampling plane", distance));
    }
    V3d origin() const {
        return side.to_slab(lamp.simple() ? lamp.slabs()[0].field.rig().centre : lamp.box().center());
    }
    PlanePatch framed(double distance, int pixels, const Workers& workers, Monitor& monitor) const {
        if (plain()) return frame_light(lamp.slabs()[0].field, distance, pixels, workers, monitor);
        const V3d o = origin();
        PlanePatch patch = frame_light(lamp, side, distance + o.z, pixels, workers, monitor);
        patch.distance = distance;
        patch.centre -= V2d(o.x, o.y);
        return patch;
    }
    PlaneIrradiance cast(const Lumigraph& channel, PlanePatch patch, const Workers& workers,
                         Monitor& monitor) const {
        if (plain()) return project(channel.slabs()[0].field, patch, workers, monitor);
        const V3d o = origin();
        patch.distance += o.z;
        patch.centre += V2d(o.x, o.y);
        return project(channel, side, patch, workers, monitor);
    }
};

// Copies rows from the top, as the screen appears when looking towards the lamp.
void copy_rows(const PlaneIrradiance& plane, int stride, double* to) {
    for (int y = plane.patch.pixels.y - 1; y >= 0; --y) {
        for (int x = 0; x < plane.patch.pixels.x; ++x, to += stride) *to = plane.at(x, y);
    }
}

py::array_t<double> project_lamp(const Lumigraph& lamp, double distance, const Pair& size,
                                 const std::array<int, 2>& resolution, const Pair& centre,
                                 const std::string& side, bool xyz, const std::optional<int>& threads) {
    if (resolution[0] < 1 || resolution[1] < 1 || std::max(resolution[0], resolution[1]) > 65536) {
        throw InputError({"resolution"}, fmt::format("({}, {}) is not accepted; expected 1 to 65536 pixels",
                                                     resolution[0], resolution[1]));
    }
    const Screen screen{lamp, parse_side("side", side)};
    const PlanePatch patch{
        distance, {centre[0], centre[1]}, {size[0], size[1]}, {resolution[0], resolution[1]}};
    if (const std::string fault = patch.fault(); !fault.empty()) throw InputError({"project"}, fault);
    screen.require_before_lamp(distance);
    const Workers workers = workers_of(threads);
    PythonMonitor monitor{py::none()};
    std::vector<py::ssize_t> shape{resolution[1], resolution[0]};
    if (xyz) shape.push_back(3);
    py::array_t<double> array(shape);
    double* to = array.mutable_data();
    monitor.run([&] {
        if (!xyz) {
            const Lumigraph& luminance = lamp;
            copy_rows(lamp.coloured() ? screen.cast(lamp.channel(1), patch, workers, monitor)
                                      : screen.cast(luminance, patch, workers, monitor),
                      1, to);
        }
        for (int c = 0; xyz && c < 3; ++c)
            copy_rows(screen.cast(lamp.channel(c), patch, workers, monitor), 3, to + c);
        return true;
    });
    return array;
}

// Returns size and centre.
std::tuple<std::tuple<double, double>, std::tuple<double, double>> frame_lamp(
    const Lumigraph& lamp, double distance, const std::string& side, const std::optional<int>& threads) {
    const Screen screen{lamp, parse_side("side", side)};
    screen.require_before_lamp(distance);
    const Workers workers = workers_of(threads);
    PythonMonitor monitor{py::none()};
    constexpr int kPixels = 512;  // as for the command's screens
    const PlanePatch patch = monitor.run([&] { return screen.framed(distance, kPixels, workers, monitor); });
    return {std::tuple(patch.size.x, patch.size.y), std::tuple(patch.centre.x, patch.centre.y)};
}

// A web and the unit of its intensities.
struct Web {
    std::shared_ptr<const PhotometricWeb> web;
    FluxUnit unit = FluxUnit::lumen;
};

Web far_field_of(const Lumigraph& lamp, double polar_step, double azimuth_step, double efficacy,
                 const std::optional<int>& threads) {
    if (!(polar_step >= 0.05 && polar_step <= 45))
        throw InputError({"polar_step"},
                         fmt::format("{:g} is not accepted; expected 0.05 to 45 degrees", polar_step));
    if (!(azimuth_step >= 0.05 && azimuth_step <= 90))
        throw InputError({"azimuth_step"},
                         fmt::format("{:g} is not accepted; expected 0.05 to 90 degrees", azimuth_step));
    if (efficacy != 0 && !(efficacy > 0 && efficacy <= kMostLumensPerWatt))
        throw InputError({"efficacy"},
                         fmt::format("{:g} is not accepted; expected lumens per watt up to {:g}", efficacy,
                                     kMostLumensPerWatt));
    const Workers workers = workers_of(threads);
    PythonMonitor monitor{py::none()};
    return monitor.run([&] {
        PhotometricWeb web = far_field(lamp, {polar_step, azimuth_step}, workers, monitor);
        FluxUnit unit = lamp.unit();
        if (unit == FluxUnit::watt && efficacy > 0) web = scaled(web, efficacy), unit = FluxUnit::lumen;
        return Web{std::make_shared<const PhotometricWeb>(std::move(web)), unit};
    });
}

Web read_web(const std::filesystem::path& file) {
    PythonMonitor monitor{py::none()};
    return monitor.run(
        [&] { return Web{std::make_shared<const PhotometricWeb>(read_photometric(file, monitor))}; });
}

Web made_web(const InputArray<double>& polar, const InputArray<double>& azimuth,
             const InputArray<float>& candela) {
    if (polar.ndim() != 1 || azimuth.ndim() != 1 || candela.ndim() != 2 ||
        candela.shape(0) != azimuth.size() || candela.shape(1) != polar.size()) {
        throw InputError({"candela"},
                         fmt::format("shapes {} of polar, {} of azimuth and {} of candela are not accepted; "
                                     "expected (n,), (m,) and (m, n)",
                                     shape_text(polar), shape_text(azimuth), shape_text(candela)));
    }
    PhotometricGrid grid;
    grid.polar.assign(polar.data(), polar.data() + polar.size());
    grid.azimuth.assign(azimuth.data(), azimuth.data() + azimuth.size());
    grid.candela.assign(candela.data(), candela.data() + candela.size());
    return {std::make_shared<const PhotometricWeb>(std::move(grid))};
}

py::array_t<double> intensities(const Web& web, const InputArray<double>& directions) {
    require_rows(directions, 3, "directions");
    py::array_t<double> array(directions.shape(0));
    for (py::ssize_t i = 0; i < directions.shape(0); ++i) {
        const V3d d(directions.at(i, 0), directions.at(i, 1), directions.at(i, 2));
        const double length = d.length();
        if (!(length > 0) || !std::isfinite(length))
            throw InputError({"directions"}, fmt::format("row {} is not a direction", i));
        array.mutable_at(i) = web.web->intensity(d / length);
    }
    return array;
}

void write_web(const Web& web, const std::filesystem::path& file, const std::string& title) {
    if (web.unit != FluxUnit::lumen)
        throw InputError(
            {"write_ies"},
            "the lamp is in W, but an .ies file is in lm; give the conversion with far_field(efficacy=...)");
    write_ies(file, *web.web, title);
}

// Returns the positions of the filters along an axis of S [m].
py::array_t<double> filters(const Rig& rig, int axis) {
    py::array_t<double> places(rig.views[axis]);
    for (int i = 0; i < rig.views[axis]; ++i) places.mutable_at(i) = rig.filter(axis, i);
    return places;
}

template <typename T>
py::array_t<T> list_of(const std::vector<T>& values) {
    return array_of<T>(std::span<const T>(values), {py::ssize_t(values.size())});
}

void bind_light_fields(py::module_& module) {
    const auto rig = [](const Lumigraph& lamp) -> const Rig& { return only_field(lamp, "planes").rig(); };
    const auto pair = [](const auto& v) { return py::make_tuple(v.x, v.y); };
    const auto triple = [](const auto& v) { return py::make_tuple(v.x, v.y, v.z); };
    py::class_<Lumigraph, Lamp>(module, "Lumigraph")
        .def_property_readonly("flux", &Lumigraph::flux)
        .def_property_readonly("unit", [](const Lumigraph& lamp) { return flux_unit_name(lamp.unit()); })
        .def_property_readonly("colour", [triple](const Lumigraph& lamp) { return triple(lamp.colour()); })
        .def_property_readonly("coloured", &Lumigraph::coloured)
        .def_property_readonly("xyz", [triple](const Lumigraph& lamp) { return triple(lamp.xyz()); })
        .def_property_readonly("missed", &Lumigraph::missed)
        .def_property_readonly("lumens_per_watt", &Lumigraph::lumens_per_watt)
        .def_property_readonly("provenance", [](const Lumigraph& lamp) { return lamp.provenance(); })
        .def_property_readonly("slab_count", [](const Lumigraph& lamp) { return lamp.slabs().size(); })
        .def("slabs", &slabs_of)
        .def_property_readonly("normal",
                               [triple](const Lumigraph& lamp) {
                                   only_field(lamp, "normal");
                                   return triple(lamp.slabs()[0].axes.n);
                               })
        .def_property_readonly("views", [=](const Lumigraph& lamp) { return pair(rig(lamp).views); })
        .def_property_readonly("spacing", [=](const Lumigraph& lamp) { return pair(rig(lamp).spacing); })
        .def_property_readonly("pixels", [=](const Lumigraph& lamp) { return pair(rig(lamp).pixels); })
        .def_property_readonly("pixel", [=](const Lumigraph& lamp) { return pair(rig(lamp).pixel); })
        .def_property_readonly("distance", [=](const Lumigraph& lamp) { return rig(lamp).distance; })
        .def_property_readonly("centre", [=](const Lumigraph& lamp) { return triple(rig(lamp).centre); })
        .def_property_readonly("u", [=](const Lumigraph& lamp) { return filters(rig(lamp), 0); })
        .def_property_readonly("v", [=](const Lumigraph& lamp) { return filters(rig(lamp), 1); })
        .def("array", &coefficients_of)
        .def("with_array", &with_array, py::arg("array"))
        .def(
            "save",
            [](const Lumigraph& lamp, const std::filesystem::path& file) { write_lumigraph(file, lamp); },
            py::call_guard<py::gil_scoped_release>())
        .def("project", &project_lamp, py::arg("distance"), py::arg("size"), py::arg("resolution"),
             py::arg("centre"), py::arg("side"), py::arg("xyz"), py::arg("threads"))
        .def("frame", &frame_lamp, py::arg("distance"), py::arg("side"), py::arg("threads"))
        .def("far_field", &far_field_of, py::arg("polar_step"), py::arg("azimuth_step"), py::arg("efficacy"),
             py::arg("threads"));
    module.def(
        "read_lumigraph", [](const std::filesystem::path& file) { return lamp_of(read_lumigraph(file)); },
        py::arg("file"), py::call_guard<py::gil_scoped_release>());
    module.def("made_lumigraph", &made_lamp, py::arg("array"), py::arg("spacing"), py::arg("pixel"),
               py::arg("distance"), py::arg("unit"), py::arg("centre"), py::arg("provenance"),
               py::arg("basis"));
    module.def("import_rays", &import_lamp, py::arg("files"), py::arg("drive"), py::arg("views"),
               py::arg("pixels"), py::arg("distance"), py::arg("capture"), py::arg("slabs"),
               py::arg("height"), py::arg("threads"), py::arg("progress"));
}

void bind_webs(py::module_& module) {
    py::class_<Web>(module, "Web")
        .def(py::init(&made_web), py::arg("polar"), py::arg("azimuth"), py::arg("candela"))
        .def_property_readonly("flux", [](const Web& web) { return web.web->flux(); })
        .def_property_readonly("peak", [](const Web& web) { return web.web->peak(); })
        .def_property_readonly("unit",
                               [](const Web& web) { return web.unit == FluxUnit::lumen ? "cd" : "W/sr"; })
        .def_property_readonly("planes",
                               [](const Web& web) {
                                   switch (web.web->grid().planes) {
                                       case PhotometricPlanes::a:
                                           return "A";
                                       case PhotometricPlanes::b:
                                           return "B";
                                       case PhotometricPlanes::c:
                                           break;
                                   }
                                   return "C";
                               })
        .def_property_readonly("polar", [](const Web& web) { return list_of(web.web->grid().polar); })
        .def_property_readonly("azimuth", [](const Web& web) { return list_of(web.web->grid().azimuth); })
        .def_property_readonly("candela",
                               [](const Web& web) {
                                   const PhotometricGrid& grid = web.web->grid();
                                   return array_of<float>(
                                       std::span<const float>(grid.candela),
                                       {py::ssize_t(grid.azimuth.size()), py::ssize_t(grid.polar.size())});
                               })
        .def_property_readonly("keywords", [](const Web& web) { return web.web->info().keywords; })
        .def_property_readonly("provenance", [](const Web& web) { return web.web->info().provenance; })
        .def("intensity", &intensities, py::arg("directions"))
        .def("write_ies", &write_web, py::arg("file"), py::arg("title"));
    module.def("read_photometric", &read_web, py::arg("file"));
}

}  // namespace

void bind_lamps(py::module_& module) {
    bind_light_fields(module);
    bind_webs(module);
}

}  // namespace lucerna
