// The extension `_lucerna`: what the Python package `lucerna` uses of the C++ libraries. The package builds a
// convenient interface on it; these four files, one per subject, contain only what needs C++.
#pragma once

#include <pybind11/pybind11.h>

namespace lucerna {

void bind_images(pybind11::module_& module);
void bind_scenes(pybind11::module_& module);
void bind_lamps(pybind11::module_& module);
void bind_maps(pybind11::module_& module);

}  // namespace lucerna
