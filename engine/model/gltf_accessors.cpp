// Reads numbers from buffers and never beyond their ends [glTF 2.0, 3.6].
#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "engine/model/gltf_reader.h"
#include "engine/system/memory.h"
#include "engine/text/plain_text.h"

namespace lucerna {

std::span<const unsigned char> GltfReader::view_bytes(int index) const {
    const tinygltf::BufferView& view = pick(in_.bufferViews, index, "buffer view");
    const std::vector<unsigned char>& data = pick(in_.buffers, view.buffer, "buffer").data;
    if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset) {
        fail("buffer view {} takes {} bytes from byte {} of a buffer of {}", index, view.byteLength,
             view.byteOffset, data.size());
    }
    return {data.data() + view.byteOffset, view.byteLength};
}

namespace {

template <typename T>
double component(const unsigned char* at, bool normalized) {
    T value;
    std::memcpy(&value, at, sizeof value);
    const auto number = static_cast<double>(value);
    if constexpr (std::is_integral_v<T>) {  // glTF 2.0, 3.6.2.2: signed values are clamped at -1
        if (normalized) return std::max(-1.0, number / static_cast<double>(std::numeric_limits<T>::max()));
    }
    return number;
}

double component_at(const unsigned char* at, int type, bool normalized) {
    switch (type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
            return component<std::int8_t>(at, normalized);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return component<std::uint8_t>(at, normalized);
        case TINYGLTF_COMPONENT_TYPE_SHORT:
            return component<std::int16_t>(at, normalized);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return component<std::uint16_t>(at, normalized);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
            return component<std::uint32_t>(at, normalized);
        default:
            return component<float>(at, normalized);  // the type is already checked
    }
}

std::size_t component_size(int type) {
    switch (type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return 1;
        case TINYGLTF_COMPONENT_TYPE_SHORT:
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return 2;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        case TINYGLTF_COMPONENT_TYPE_FLOAT:
            return 4;
        default:
            return 0;
    }
}

}  // namespace

// Returns all numbers of an accessor, `components` per element. `what` names it in errors.
std::vector<double> GltfReader::numbers(int index, int components, std::string_view what) const {
    const tinygltf::Accessor& accessor = pick(in_.accessors, index, fmt::format("accessor of {}", what));
    if (tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)) != components) {
        fail("{}: accessor {} does not have {} numbers for each element", what, index, components);
    }
    if (component_size(accessor.componentType) == 0) {
        fail("{}: accessor {} has component type {}; expected 5120 to 5126 without 5124", what, index,
             accessor.componentType);
    }
    // Counts are limited by the bytes of the file, and those of implicit zeros, which need no bytes, by
    // memory.
    if (accessor.count > kMostCount) fail("{}: accessor {} claims {} elements", what, index, accessor.count);
    require_memory(bytes_of(accessor.count, static_cast<std::uint64_t>(components) * sizeof(double)),
                   fmt::format("{}: {}, accessor {} of {} elements", file_.string(), one_line(what), index,
                               accessor.count),
                   "use fewer elements");
    std::vector<double> out;
    if (accessor.bufferView >= 0) {
        read_elements(out, accessor, components, fmt::format("{}, accessor {}", what, index));
    } else {
        if (accessor.count > 100'000'000)
            fail("{}: accessor {} claims {} zeros", what, index, accessor.count);
        out.resize(accessor.count * static_cast<std::size_t>(components));
    }
    if (accessor.sparse.isSparse) apply_sparse(out, accessor, components);
    for (const double number : out) {
        if (!std::isfinite(number))
            fail("{}: accessor {} holds {}; expected finite numbers", what, index, number);
    }
    return out;
}

void GltfReader::read_elements(std::vector<double>& out, const tinygltf::Accessor& accessor, int components,
                               std::string_view what) const {
    const std::span<const unsigned char> bytes = view_bytes(accessor.bufferView);
    const std::size_t each = component_size(accessor.componentType);
    const std::size_t element = each * static_cast<std::size_t>(components);
    const std::size_t given = in_.bufferViews[static_cast<std::size_t>(accessor.bufferView)].byteStride;
    const std::size_t stride = given == 0 ? element : given;
    if (stride < element) fail("{}: a stride of {} bytes for elements of {}", what, stride, element);
    if (accessor.count == 0) return;
    // The last element must end within the view: offset + (count - 1) stride + element <= size. This form
    // does not overflow.
    const bool fits = accessor.byteOffset <= bytes.size() && element <= bytes.size() - accessor.byteOffset &&
                      accessor.count - 1 <= (bytes.size() - accessor.byteOffset - element) / stride;
    if (!fits) {
        fail("{}: {} elements of {} bytes from byte {} do not fit into a view of {}", what, accessor.count,
             element, accessor.byteOffset, bytes.size());
    }
    out.reserve(accessor.count * static_cast<std::size_t>(components));
    for (std::size_t i = 0; i < accessor.count; ++i) {
        const unsigned char* at = bytes.data() + accessor.byteOffset + i * stride;
        for (int c = 0; c < components; ++c) {
            out.push_back(component_at(at + static_cast<std::size_t>(c) * each, accessor.componentType,
                                       accessor.normalized));
        }
    }
}

// Replaces some elements by those of a sparse accessor, with ascending indices.
void GltfReader::apply_sparse(std::vector<double>& out, const tinygltf::Accessor& accessor,
                              int components) const {
    const auto& sparse = accessor.sparse;
    // Some of these are unsigned in newer versions of tinygltf.
    if (std::cmp_less(sparse.count, 0) || std::cmp_less(sparse.indices.byteOffset, 0) ||
        std::cmp_less(sparse.values.byteOffset, 0)) {
        fail("a sparse accessor has a negative count or offset");
    }
    tinygltf::Accessor part;
    part.count = static_cast<std::size_t>(sparse.count);
    part.bufferView = sparse.indices.bufferView;
    part.byteOffset = static_cast<std::size_t>(sparse.indices.byteOffset);
    part.componentType = sparse.indices.componentType;
    if (component_size(part.componentType) == 0)
        fail("sparse indices of component type {}", part.componentType);
    std::vector<double> indices, values;
    read_elements(indices, part, 1, "sparse indices");
    part.bufferView = sparse.values.bufferView;
    part.byteOffset = static_cast<std::size_t>(sparse.values.byteOffset);
    part.componentType = accessor.componentType;
    part.normalized = accessor.normalized;
    read_elements(values, part, components, "sparse values");
    const auto width = static_cast<std::size_t>(components);
    for (std::size_t i = 0; i < indices.size(); ++i) {
        if (!(indices[i] >= 0 && indices[i] < static_cast<double>(out.size() / width))) {
            fail("sparse index {} of an accessor of {}", indices[i], out.size() / width);
        }
        std::copy_n(&values[i * width], width, &out[static_cast<std::size_t>(indices[i]) * width]);
    }
}

}  // namespace lucerna
