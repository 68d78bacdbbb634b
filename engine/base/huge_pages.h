// Memory for large arrays, in pages of 2 MB where the system grants them.
//
// A table of a hundred megabytes has more ordinary pages than the TLB holds, so every read would wait for the
// page tables as well as for the data. The pages of an image are many, too: when it is made, the system would
// be called for each of them.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace lucerna {

// Throws std::bad_alloc. Small blocks come from ordinary memory.
void* allocate_in_huge_pages(std::size_t bytes);
void free_huge_pages(void* memory);

template <typename T>
struct HugePageAllocator {
    using value_type = T;
    HugePageAllocator() = default;
    template <typename Other>
    HugePageAllocator(const HugePageAllocator<Other>& /*other*/) {}  // NOLINT: allocators convert

    // std::vector asks for at most PTRDIFF_MAX bytes, so the product does not overflow.
    T* allocate(std::size_t n) { return static_cast<T*>(allocate_in_huge_pages(n * sizeof(T))); }
    void deallocate(T* memory, std::size_t /*n*/) { free_huge_pages(memory); }
    bool operator==(const HugePageAllocator& /*other*/) const { return true; }
};

template <typename T>
using HugeVector = std::vector<T, HugePageAllocator<T>>;

// Returns `count` * `each` bytes that are 0. A large block is zeroed by the system, page by page, when a
// thread first touches it. Throws std::bad_alloc.
void* allocate_zeroed(std::size_t count, std::size_t each);
// Frees such a block; `bytes` = count * each.
void free_zeroed(void* memory, std::size_t bytes);

// Leaves elements without an initial value as the bytes that they consist of are: 0. A vector must therefore
// not be made shorter and then longer again. T is a type whose default value is all zero bytes.
template <typename T>
struct ZeroedAllocator {
    using value_type = T;
    ZeroedAllocator() = default;
    template <typename Other>
    ZeroedAllocator(const ZeroedAllocator<Other>& /*other*/) {}  // NOLINT: allocators convert

    T* allocate(std::size_t n) { return static_cast<T*>(allocate_zeroed(n, sizeof(T))); }
    void deallocate(T* memory, std::size_t n) { free_zeroed(memory, n * sizeof(T)); }
    template <typename Element, typename... Values>
    void construct(Element* at, Values&&... values) {
        if constexpr (sizeof...(Values) > 0)
            ::new (static_cast<void*>(at)) Element(std::forward<Values>(values)...);
    }
    bool operator==(const ZeroedAllocator& /*other*/) const { return true; }
};

// An array whose pages the threads that fill it get in parallel.
template <typename T>
using ZeroedVector = std::vector<T, ZeroedAllocator<T>>;

}  // namespace lucerna
