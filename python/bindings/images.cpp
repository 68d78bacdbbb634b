// Bindings of images: named channels as arrays, EXR and PNG files, comparison.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/elementary.h"
#include "engine/colour/colour_space.h"
#include "engine/colour/tone.h"
#include "engine/colour/working_space.h"
#include "engine/evaluation/comparison.h"
#include "engine/image/displayed.h"
#include "engine/image/image.h"
#include "python/bindings/arrays.h"
#include "python/bindings/bindings.h"
#include "python/bindings/python_monitor.h"

namespace lucerna {
namespace {

namespace py = pybind11;

// Returns an array (H, W, channels) of the named channels, in that order.
py::array_t<float> channels_of(const Image& image, const std::vector<std::string>& names) {
    std::vector<std::size_t> from;
    for (const std::string& name : names) {
        const auto channel = find_channel(image, name);
        if (!channel) throw py::key_error(name);
        from.push_back(*channel);
    }
    py::array_t<float> array(std::vector<py::ssize_t>{image.height, image.width, py::ssize_t(names.size())});
    float* to = array.mutable_data();
    for (std::size_t pixel = 0; pixel < image.data.size(); pixel += image.channels.size()) {
        for (const std::size_t channel : from) *to++ = image.data[pixel + channel];
    }
    return array;
}

Image image_of(const std::vector<std::string>& names, const InputArray<float>& values,
               std::map<std::string, std::string> attributes, const std::optional<std::string>& space) {
    if (values.ndim() != 3 || values.shape(2) != py::ssize_t(names.size()) || values.size() == 0) {
        throw InputError(fmt::format("image: shape {} is not accepted; expected (height, width, {})",
                                     shape_text(values), names.size()));
    }
    constexpr py::ssize_t kMost = std::numeric_limits<int>::max();
    if (values.shape(0) > kMost || values.shape(1) > kMost)
        throw InputError(fmt::format("image: shape {} is too large", shape_text(values)));
    Image image(static_cast<int>(values.shape(1)), static_cast<int>(values.shape(0)), names);
    std::copy(values.data(), values.data() + values.size(), image.data.begin());
    image.attributes = std::move(attributes);
    if (space) {
        const auto known = WorkingSpace::named(*space);
        if (!known) {
            throw InputError({"colour_space"}, fmt::format("\"{}\" is unknown; expected {}", *space,
                                                           fmt::join(WorkingSpace::names(), ", ")));
        }
        if (!known->is_srgb()) image.space = &known->space();
    }
    return image;
}

PictureLook look_of(const Image& image, const std::optional<double>& stops, const std::string& tone,
                    const std::optional<double>& white) {
    const auto curve = tone_curve_named(tone);
    if (!curve) {
        throw InputError({"tone"}, fmt::format("\"{}\" is unknown; expected {}", tone,
                                               fmt::join(tone_curve_names(), " or ")));
    }
    if (white && !(*white >= kLeastWhite && *white <= kMostWhite)) {
        throw InputError({"white"}, fmt::format("{:g} is not accepted; expected {:g} to {:g}, in kelvins",
                                                *white, kLeastWhite, kMostWhite));
    }
    return {stops ? static_cast<float>(exp2(*stops)) : auto_exposure(image), *curve, white};
}

std::string compare_json(const std::vector<Image>& images, const Image& reference, double mask_above,
                         int z_cell, bool flip, const std::optional<int>& threads) {
    ComparisonSettings settings;
    settings.mask_above = mask_above;
    settings.z_cell = z_cell;
    settings.flip = flip;
    settings.workers = workers_of(threads);
    std::vector<NamedImage> named;
    for (const Image& image : images) named.push_back({fmt::format("image {}", named.size()), image});
    PythonMonitor monitor{py::none()};
    return monitor.run([&] {
        return comparison_json(compare_images(named, {"reference", reference}, settings, monitor));
    });
}

}  // namespace

void bind_images(py::module_& module) {
    py::class_<Image>(module, "Image")
        .def(py::init(&image_of), py::arg("channels"), py::arg("values"), py::arg("attributes"),
             py::arg("colour_space"))
        .def_readonly("width", &Image::width)
        .def_readonly("height", &Image::height)
        .def_readonly("channels", &Image::channels)
        .def_readonly("attributes", &Image::attributes)
        .def_property_readonly(
            "colour_space",
            [](const Image& image) {
                return std::string(image.space ? image.space->name : WorkingSpace().name());
            })
        .def("array", &channels_of, py::arg("channels"))
        .def(
            "write_exr",
            [](const Image& image, const std::filesystem::path& file) { write_exr(file, image); },
            py::arg("file"), py::call_guard<py::gil_scoped_release>())
        .def(
            "write_png",
            [](const Image& image, const std::filesystem::path& file, const std::optional<double>& stops,
               const std::string& tone, const std::optional<double>& white) {
                write_png(file, image, look_of(image, stops, tone, white));
            },
            py::arg("file"), py::arg("exposure"), py::arg("tone"), py::arg("white_balance"),
            py::call_guard<py::gil_scoped_release>());
    module.def("read_exr", &read_exr, py::arg("file"), py::call_guard<py::gil_scoped_release>());
    module.def("compare_json", &compare_json, py::arg("images"), py::arg("reference"), py::arg("mask_above"),
               py::arg("cells"), py::arg("flip"), py::arg("threads"));
}

}  // namespace lucerna
