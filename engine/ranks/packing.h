// Packs values into bytes, for ranks of one program on machines of one kind: numbers, structs of numbers,
// strings, vectors and arrays of these, and structs that list their fields: `template <typename Archive> void
// fields(Archive& archive) { archive(a, b); }` serves for packing and unpacking.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace lucerna {

// Imath's vectors have copy constructors of their own, and so are not trivially copyable; their bytes can be
// copied.
template <typename T>
inline constexpr bool is_plain_data =
    std::is_trivially_destructible_v<T>&& std::is_standard_layout_v<T> && !std::is_pointer_v<T>;

class Packer {
  public:
    static constexpr bool kUnpacks = false;

    template <typename... Fields>
    void operator()(const Fields&... fields) {
        (put(fields), ...);
    }
    std::vector<std::byte> take() { return std::move(bytes_); }
    std::size_t size() const { return bytes_.size(); }

  private:
    void put_bytes(std::span<const std::byte> bytes) {
        bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    }
    template <typename T>
    void put(const T& value) {
        if constexpr (requires(T & t, Packer & p) { t.fields(p); }) {
            const_cast<T&>(value).fields(*this);  // fields() only reads them for a Packer.
        } else {
            static_assert(is_plain_data<T>);
            put_bytes(std::as_bytes(std::span(&value, 1)));
        }
    }
    void put(const std::string& text) {
        put(text.size());
        put_bytes(std::as_bytes(std::span(text)));
    }
    template <typename T>
    void put(const std::vector<T>& values) {
        put(values.size());
        put(std::span<const T>(values));
    }
    template <typename T, std::size_t n>
    void put(const std::array<T, n>& values) {
        put(std::span<const T>(values));
    }
    // A span has as many values on both sides, and its size is not packed.
    template <typename T, std::size_t n>
    void put(const std::span<T, n>& values) {
        if constexpr (is_plain_data<T>) {
            put_bytes(std::as_bytes(values));
        } else {
            for (const T& value : values) put(value);
        }
    }

    std::vector<std::byte> bytes_;
};

class Unpacker {
  public:
    static constexpr bool kUnpacks = true;

    explicit Unpacker(std::span<const std::byte> bytes) : left_(bytes) {}

    template <typename... Fields>
    void operator()(Fields&&... fields) {
        (take(fields), ...);
    }
    template <typename T>
    T next() {
        T value{};
        take(value);
        return value;
    }
    bool empty() const { return left_.empty(); }
    std::span<const std::byte> left() const { return left_; }

  private:
    void take_bytes(std::span<std::byte> to) {
        assert(to.size() <= left_.size());
        if (!to.empty()) std::memcpy(to.data(), left_.data(), to.size());
        left_ = left_.subspan(to.size());
    }
    template <typename T>
    void take(T& value) {
        if constexpr (requires(T & t, Unpacker & u) { t.fields(u); }) {
            value.fields(*this);
        } else {
            static_assert(is_plain_data<T>);
            take_bytes(std::as_writable_bytes(std::span(&value, 1)));
        }
    }
    void take(std::string& text) {
        std::size_t size = 0;
        take(size);
        text.resize(size);
        take_bytes(std::as_writable_bytes(std::span(text)));
    }
    template <typename T>
    void take(std::vector<T>& values) {
        std::size_t size = 0;
        take(size);
        values.resize(size);
        std::span<T> all(values);
        take(all);
    }
    template <typename T, std::size_t n>
    void take(std::array<T, n>& values) {
        std::span<T, n> all(values);
        take(all);
    }
    template <typename T, std::size_t n>
    void take(std::span<T, n>& values) {
        if constexpr (is_plain_data<T>) {
            take_bytes(std::as_writable_bytes(values));
        } else {
            for (T& value : values) take(value);
        }
    }

    std::span<const std::byte> left_;
};

}  // namespace lucerna
