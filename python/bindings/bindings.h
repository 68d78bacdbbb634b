// The extension `_lucerna`: what of the C++ libraries the Python package `lucerna` stands on. What is
// pleasant to write is made of it there; here is what needs C++, in four files by subject.
#pragma once

#include <pybind11/pybind11.h>

namespace lucerna {

void bind_images(pybind11::module_& module);
void bind_scenes(pybind11::module_& module);
void bind_lamps(pybind11::module_& module);
void bind_maps(pybind11::module_& module);

}  // namespace lucerna
