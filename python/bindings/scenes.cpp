// Bindings of scenes, renders, and illuminance in scenes.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "engine/base/error.h"
#include "engine/cli/photometry/surface_options.h"
#include "engine/cli/render/render_request.h"
#include "engine/cli/render/run_report.h"
#include "engine/denoise/denoise.h"
#include "engine/integrators/settings.h"
#include "engine/pbrt/read_scene.h"
#include "engine/photometry/illuminance.h"
#include "engine/render/chance_light.h"
#include "engine/render/render.h"
#include "python/bindings/arrays.h"
#include "python/bindings/bindings.h"
#include "python/bindings/python_monitor.h"

namespace lucerna {
namespace {

namespace py = pybind11;

using Settings = std::vector<std::pair<std::string, SettingValue>>;

std::shared_ptr<ObjectMesh> mesh_of(const InputArray<double>& vertices, const InputArray<int>& triangles,
                                    const std::optional<InputArray<double>>& normals,
                                    const std::optional<InputArray<float>>& uv) {
    require_rows(vertices, 3, "vertices");
    require_rows(triangles, 3, "triangles");
    if (vertices.shape(0) > std::numeric_limits<int>::max())
        throw InputError({"vertices"}, "too many; the limit is 2147483647");
    auto mesh = std::make_shared<ObjectMesh>();
    const auto triples = [](const InputArray<double>& array) {
        std::vector<V3d> result;
        result.reserve(static_cast<std::size_t>(array.shape(0)));
        for (py::ssize_t i = 0; i < array.shape(0); ++i)
            result.emplace_back(array.at(i, 0), array.at(i, 1), array.at(i, 2));
        return result;
    };
    mesh->p = triples(vertices);
    mesh->triangles.reserve(static_cast<std::size_t>(triangles.shape(0)));
    for (py::ssize_t i = 0; i < triangles.shape(0); ++i)
        mesh->triangles.emplace_back(triangles.at(i, 0), triangles.at(i, 1), triangles.at(i, 2));
    if (normals) {
        require_rows(*normals, 3, "normals");
        mesh->n = triples(*normals);
    }
    if (uv) {
        require_rows(*uv, 2, "uv");
        for (py::ssize_t i = 0; i < uv->shape(0); ++i) mesh->uv.emplace_back(uv->at(i, 0), uv->at(i, 1));
    }
    return mesh;
}

// The part of a job that a render changes, as the scene states it.
struct AsRead {
    IntegratorSettings integrator;
    int spp = 0;
    FilmSettings film;
};

// A scene's text, and the job that was read from it for the most recently requested method.
class ReadScene {
  public:
    // Without `text`, `file` is read; otherwise relative names in the text start from the file's folder.
    ReadScene(std::filesystem::path file, std::optional<std::string> text, SceneOverrides overrides)
        : file_(std::move(file)), text_(std::move(text)), overrides_(std::move(overrides)) {}

    // If two threads render the same scene, one waits for the other.
    std::mutex& mutex() { return mutex_; }
    const std::filesystem::path& file() const { return file_; }
    const SceneOverrides& overrides() const { return overrides_; }

    // Returns the job as the command would read it with these options. Only the members that AsRead holds may
    // be changed, until the next call. A different method changes more than its own settings (the scene's
    // maxdepth, emissive media, samples by passes), so the text is read again.
    Job& job(const std::string& integrator, const Settings& settings, const Workers& workers,
             Monitor& monitor) {
        const std::string name = integrator.empty() ? overrides_.integrator : integrator;
        if (!job_ || read_integrator_ != name) read(name, workers, monitor);
        job_->integrator = as_read_->integrator;
        job_->spp = as_read_->spp;
        job_->film = as_read_->film;
        for (const auto& [key, value] : settings) set_parameter(job_->integrator, key, value, {key});
        return *job_;
    }

    // Reads the scene again, for callers that consume the job.
    Job fresh_job(const Workers& workers, Monitor& monitor) const {
        return text_ ? read_scene_text(*text_, file_, overrides_, workers, monitor)
                     : read_scene(file_, overrides_, workers, monitor);
    }

    double read_seconds() const { return read_seconds_; }

  private:
    void read(const std::string& integrator, const Workers& workers, Monitor& monitor) {
        const Stopwatch watch;
        SceneOverrides overrides = overrides_;
        overrides.integrator = integrator;
        job_.reset();  // frees the old job first, so that only one is in memory
        job_.emplace(text_ ? read_scene_text(*text_, file_, overrides, workers, monitor)
                           : read_scene(file_, overrides, workers, monitor));
        as_read_ = AsRead{job_->integrator, job_->spp, job_->film};
        read_integrator_ = integrator;
        read_seconds_ = watch.seconds();
    }

    std::filesystem::path file_;
    std::optional<std::string> text_;
    SceneOverrides overrides_;
    std::string read_integrator_;
    std::optional<Job> job_;
    std::optional<AsRead> as_read_;
    double read_seconds_ = 0;
    std::mutex mutex_;
};

std::shared_ptr<ReadScene> read(std::filesystem::path file, std::optional<std::string> text,
                                const std::string& integrator, std::optional<std::pair<int, int>> resolution,
                                const std::optional<std::string>& colour_space, bool skip_missing,
                                bool strict, NamedMeshes meshes, const std::optional<int>& threads,
                                const py::object& progress) {
    SceneOverrides overrides;
    overrides.integrator = integrator;
    if (resolution) overrides.resolution = {resolution->first, resolution->second};
    if (resolution && (resolution->first < 1 || resolution->second < 1 ||
                       std::max(resolution->first, resolution->second) > 65536)) {
        throw InputError({"resolution"}, fmt::format("({}, {}) is not accepted; expected 1 to 65536 pixels",
                                                     resolution->first, resolution->second));
    }
    if (colour_space) {
        overrides.colours = WorkingSpace::named(*colour_space);
        if (!overrides.colours) {
            throw InputError({"colour_space"}, fmt::format("\"{}\" is unknown; expected {}", *colour_space,
                                                           fmt::join(WorkingSpace::names(), ", ")));
        }
    }
    overrides.skip_missing = skip_missing;
    overrides.strict = strict;
    overrides.meshes = std::move(meshes);
    auto scene = std::make_shared<ReadScene>(std::move(file), std::move(text), std::move(overrides));
    PythonMonitor monitor(progress);
    const Workers workers = workers_of(threads);
    monitor.run([&] {
        scene->job("", {}, workers, monitor);
        return true;
    });
    return scene;
}

struct Rendered {
    Image image;         // as in its file
    std::string report;  // JSON
    bool complete = true;
};

// The request for one render.
struct Asked {
    std::string integrator;
    Settings settings;
    RenderRequest request;
    RenderOptions options;  // limits.seconds is for the whole render
    bool chooses = false;   // chooses the method if a limit is given
};

Rendered render_now(ReadScene& scene, Asked& asked, const Stopwatch& clock, PythonMonitor& monitor) {
    const std::lock_guard lock(scene.mutex());
    RenderOptions& options = asked.options;
    Job& job = scene.job(asked.integrator, asked.settings, options.workers, monitor);
    if (asked.request.spp > 0) job.spp = asked.request.spp;
    apply(asked.request, options.limits, job);
    RunFacts facts{scene.file(), options.seed, options.workers.threads};
    facts.read_seconds = scene.read_seconds();

    options.limits.seconds -= clock.seconds();
    const Stopwatch rendering;
    const bool chooses = asked.chooses && has_limit(options.limits);
    RenderResult result =
        chooses ? render_by_choice(job, options, facts, monitor) : render_as_asked(job, options, monitor);
    facts.render_seconds = rendering.seconds() - facts.choose_seconds;
    facts.warnings = monitor.warnings();
    Rendered rendered;
    rendered.complete = result.report.complete;
    rendered.report = statistics_json(facts, job, result.report, {});
    complete_image(facts, job, {asked.request.layers, asked.request.layers, {}}, options.workers, result);
    rendered.image = std::move(result.image);
    return rendered;
}

std::optional<PixelBox> box_of(const std::optional<std::array<int, 4>>& crop) {
    if (!crop) return std::nullopt;
    const auto& [x0, y0, x1, y1] = *crop;
    if (x0 < 0 || y0 < 0 || x0 >= x1 || y0 >= y1) {
        throw InputError(
            {"crop"},
            fmt::format(
                "({}, {}, {}, {}) is not accepted; expected (x0, y0, x1, y1) with x0 < x1 and y0 < y1", x0,
                y0, x1, y1));
    }
    return PixelBox{{x0, y0}, {x1, y1}};
}

Rendered render_scene(ReadScene& scene, const std::string& integrator, const Settings& settings, int spp,
                      int passes, double time, double error, std::uint64_t seed,
                      const std::optional<int>& threads, bool layers, bool denoise, bool adaptive,
                      const std::optional<std::array<int, 4>>& crop, const py::object& progress,
                      bool keep_partial) {
    const Stopwatch clock;
    Asked asked;
    asked.integrator = integrator;
    asked.settings = settings;
    asked.request = {passes, spp, box_of(crop), denoise, adaptive, layers};
    asked.options.seed = seed;
    asked.options.workers = workers_of(threads);
    asked.options.limits = {time, error};
    asked.chooses = integrator.empty() && settings.empty() && spp == 0 && passes == 0;
    PythonMonitor monitor(progress);
    const auto work = [&] { return render_now(scene, asked, clock, monitor); };
    if (!keep_partial) return monitor.run(work);
    std::optional<Rendered> rendered = monitor.run_to_end(work);
    bool interrupted = false;
    if (monitor.raised()) {
        try {
            std::rethrow_exception(monitor.raised());
        } catch (const py::error_already_set& raised) {
            interrupted = raised.matches(PyExc_KeyboardInterrupt);
        }
    }
    if (monitor.raised() && !(rendered && interrupted)) std::rethrow_exception(monitor.raised());
    return std::move(*rendered);
}

// Illuminance on calculation surfaces.

using Triple = std::array<double, 3>;

V3d point_of(const Triple& p) {
    return {p[0], p[1], p[2]};
}

CalculationSurface surface_of(const std::string& name, const Triple& corner, const Triple& u, const Triple& v,
                              const std::string& kind, const std::optional<std::array<int, 2>>& points,
                              const std::optional<Triple>& facing) {
    const Location at{name};
    SurfaceOptions options;
    const auto known = receiver_kind(kind);
    if (!known) {
        throw InputError(
            at, fmt::format("kind \"{}\" is unknown; expected {}", kind, fmt::join(kReceiverKinds, ", ")));
    }
    options.kind = *known;
    if (facing) {
        const V3d towards = point_of(*facing);
        if (!(towards.length() > 0) || !std::isfinite(towards.length()))
            throw InputError(at, "facing is not a direction");
        options.facing = towards.normalized();
    }
    const V3d from = point_of(corner);
    CalculationSurface surface =
        surface_at(options, name, {from, from + point_of(u), from + point_of(v)}, at);
    if (!points) return surface;
    surface.points = {(*points)[0], (*points)[1]};
    check_surface(surface, at);
    return surface;
}

// Returns arrays of (v, u), with v upwards from the corner.
py::dict grid_of(const SurfaceIlluminance& of, const IlluminanceReport& report) {
    const V2i& n = of.surface.points;
    const std::vector<py::ssize_t> shape{n.y, n.x};
    const auto array = [&](auto&& value) {
        std::vector<double> values;
        for (const PointIlluminance& point : of.points) values.push_back(value(point));
        return array_of<double>(std::span<const double>(values), shape);
    };
    const auto pair = [](const Reading95& r) { return py::make_tuple(r.value, r.half_width); };
    py::array_t<double> positions({py::ssize_t{n.y}, py::ssize_t{n.x}, py::ssize_t{3}});
    for (int y = 0; y < n.y; ++y) {
        for (int x = 0; x < n.x; ++x) {
            const V3d p = of.surface.position(x, y);
            for (int axis = 0; axis < 3; ++axis) positions.mutable_at(y, x, axis) = p[axis];
        }
    }
    py::dict groups;
    for (std::size_t i = 0; i < report.groups.size(); ++i)
        groups[py::str(report.groups[i])] =
            array([i](const PointIlluminance& point) { return point.groups[i]; });
    py::dict grid;
    grid["name"] = of.surface.name;
    grid["kind"] = std::string(receiver_kind_name(of.surface.kind));
    grid["unit"] = report.unit;
    grid["positions"] = positions;
    grid["values"] = array([](const PointIlluminance& point) { return point.all.value; });
    grid["half_width"] = array([](const PointIlluminance& point) { return point.all.half_width; });
    grid["direct"] = array([](const PointIlluminance& point) { return point.direct; });
    grid["groups"] = groups;
    grid["mean"] = pair(of.mean);
    grid["least"] = pair(of.least);
    grid["greatest"] = pair(of.greatest);
    grid["uniformity"] = pair(of.uniformity);
    grid["precision"] = report.precision;
    return grid;
}

py::list illuminance_of(const ReadScene& scene, const std::optional<std::vector<CalculationSurface>>& asked,
                        double precision, double time, int samples, std::uint64_t seed,
                        const std::optional<int>& threads, const py::object& progress) {
    const Stopwatch clock;
    IlluminanceOptions options;
    options.seed = seed;
    options.workers = workers_of(threads);
    options.precision = precision;
    options.most_samples = samples;
    PythonMonitor monitor(progress);
    const IlluminanceReport report = monitor.run([&] {
        Job job = scene.fresh_job(options.workers, monitor);
        const std::vector<CalculationSurface> surfaces = asked ? *asked : job.surfaces;
        if (surfaces.empty()) {
            throw InputError({"surfaces"},
                             "the scene has no CalculationSurface; a list of lucerna.CalculationSurface is "
                             "accepted");
        }
        options.seconds = time - clock.seconds();
        return illuminance_on(surfaces, std::move(job), options, monitor);
    });
    py::list grids;
    for (const SurfaceIlluminance& of : report.surfaces) grids.append(grid_of(of, report));
    return grids;
}

}  // namespace

void bind_scenes(py::module_& module) {
    py::class_<ObjectMesh, std::shared_ptr<ObjectMesh>>(module, "Mesh")
        .def(py::init(&mesh_of), py::arg("vertices"), py::arg("triangles"), py::arg("normals"),
             py::arg("uv"));
    py::class_<ReadScene, std::shared_ptr<ReadScene>>(module, "Scene")
        .def_property_readonly("file", [](const ReadScene& scene) { return scene.file(); });
    py::class_<Rendered>(module, "Rendered")
        .def_readonly("image", &Rendered::image)
        .def_readonly("report", &Rendered::report)
        .def_readonly("complete", &Rendered::complete);
    module.def(
        "read_scene",
        [](std::filesystem::path file, std::optional<std::string> text, const std::string& integrator,
           std::optional<std::pair<int, int>> resolution, const std::optional<std::string>& colour_space,
           bool skip_missing, bool strict, const std::map<std::string, std::shared_ptr<ObjectMesh>>& meshes,
           const std::optional<int>& threads, const py::object& progress) {
            return read(std::move(file), std::move(text), integrator, resolution, colour_space, skip_missing,
                        strict, NamedMeshes(meshes.begin(), meshes.end()), threads, progress);
        },
        py::arg("file"), py::arg("text"), py::arg("integrator"), py::arg("resolution"),
        py::arg("colour_space"), py::arg("skip_missing"), py::arg("strict"), py::arg("meshes"),
        py::arg("threads"), py::arg("progress"));
    py::class_<CalculationSurface>(module, "CalculationSurface")
        .def(py::init(&surface_of), py::arg("name"), py::arg("corner"), py::arg("u"), py::arg("v"),
             py::arg("kind") = "planar", py::arg("points") = py::none(), py::arg("facing") = py::none())
        .def_readonly("name", &CalculationSurface::name)
        .def_property_readonly("points", [](const CalculationSurface& surface) {
            return py::make_tuple(surface.points.x, surface.points.y);
        });
    module.def("illuminance", &illuminance_of, py::arg("scene"), py::arg("surfaces"), py::arg("precision"),
               py::arg("time"), py::arg("samples"), py::arg("seed"), py::arg("threads"), py::arg("progress"));
    module.def("render", &render_scene, py::arg("scene"), py::arg("integrator"), py::arg("settings"),
               py::arg("spp"), py::arg("passes"), py::arg("time"), py::arg("error"), py::arg("seed"),
               py::arg("threads"), py::arg("layers"), py::arg("denoise"), py::arg("adaptive"),
               py::arg("crop"), py::arg("progress"), py::arg("keep_partial"));
}

}  // namespace lucerna
