// Conversion of NumPy arrays, always by copy, so that neither side's memory depends on the other.
#pragma once

#include <fmt/format.h>
#include <pybind11/numpy.h>

#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"

namespace lucerna {

// An input array of any kind, converted to this type and to contiguous rows.
template <typename T>
using InputArray = pybind11::array_t<T, pybind11::array::c_style | pybind11::array::forcecast>;

template <typename T, typename U>
pybind11::array_t<T> array_of(std::span<const U> values, const std::vector<pybind11::ssize_t>& shape) {
    pybind11::array_t<T> array(shape);
    std::copy(values.begin(), values.end(), array.mutable_data());
    return array;
}

template <typename T>
std::span<const T> values_of(const InputArray<T>& array) {
    return {array.data(), static_cast<std::size_t>(array.size())};
}

// Returns for example "(3, 4)".
inline std::string shape_text(const pybind11::array& array) {
    std::string text = "(";
    for (pybind11::ssize_t i = 0; i < array.ndim(); ++i)
        text += fmt::format("{}{}", i > 0 ? ", " : "", array.shape(i));
    return text + ")";
}

// Throws InputError unless the array has rows of that many columns.
inline void require_rows(const pybind11::array& array, pybind11::ssize_t columns, const char* name) {
    if (array.ndim() == 2 && array.shape(1) == columns) return;
    throw InputError(
        fmt::format("{}: shape {} is not accepted; expected (n, {})", name, shape_text(array), columns));
}

}  // namespace lucerna
