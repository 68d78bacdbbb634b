// Bindings of saved photon maps.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "photon/build_maps.h"
#include "python/bindings/arrays.h"
#include "python/bindings/bindings.h"

namespace lucerna {
namespace {

namespace py = pybind11;

// Returns a row of three values for each photon.
template <typename T, typename Of>
py::array_t<T> rows(const Photons& photons, const Of& of) {
    py::array_t<T> array({static_cast<py::ssize_t>(photons.size()), py::ssize_t{3}});
    T* to = array.mutable_data();
    for (std::size_t i = 0; i < photons.size(); ++i) {
        const auto row = of(i);
        for (int c = 0; c < 3; ++c) *to++ = static_cast<T>(row[c]);
    }
    return array;
}

template <typename T, typename Of>
py::array_t<T> column(const Photons& photons, const Of& of) {
    py::array_t<T> array(static_cast<py::ssize_t>(photons.size()));
    for (std::size_t i = 0; i < photons.size(); ++i) array.mutable_data()[i] = static_cast<T>(of(i));
    return array;
}

py::dict arrays_of(const Photons& photons, MapKind kind, const V3d& place) {
    py::dict arrays;
    arrays["positions"] =
        rows<double>(photons, [&](std::size_t i) { return V3d(photons.positions[i]) + place; });
    arrays["directions"] =
        rows<float>(photons, [&](std::size_t i) { return photons.photons[i].direction.unpack(); });
    arrays["powers"] = rows<float>(photons, [&](std::size_t i) {
        const Rgb& power = photons.photons[i].power;
        return V3f(power.x, power.y, power.z);
    });
    if (kind == MapKind::volume) {
        arrays["normals"] = py::none();
    } else {
        arrays["normals"] = rows<float>(photons, [&](std::size_t i) { return photons.normals[i].unpack(); });
    }
    arrays["lights"] =
        column<std::uint32_t>(photons, [&](std::size_t i) { return photons.photons[i].light; });
    arrays["bounces"] = column<std::uint8_t>(photons, [&](std::size_t i) { return photons.bounces[i]; });
    return arrays;
}

py::dict read_photon_maps(const std::filesystem::path& file) {
    const SavedMaps saved = read_maps(file);
    py::dict maps, made_for, read;
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        if (!saved.maps[kind]) continue;
        const auto of = static_cast<MapKind>(kind);
        maps[py::str(std::string(map_name(of)))] = arrays_of(*saved.maps[kind], of, saved.origin.place);
    }
    for (const auto& [name, value] : saved.origin.facts) made_for[py::str(name)] = value;
    read["scene"] = saved.origin.scene;
    read["unit"] = saved.origin.unit;
    read["light_paths"] = saved.ledger.paths;
    read["made_for"] = made_for;
    read["maps"] = maps;
    return read;
}

}  // namespace

void bind_maps(py::module_& module) {
    module.def("read_photon_maps", &read_photon_maps, py::arg("file"));
}

}  // namespace lucerna
