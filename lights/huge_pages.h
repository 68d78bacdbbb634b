// Memory for tables with random access, in pages of 2 MB where the system grants them.
//
// A table of a hundred megabytes has more ordinary pages than the TLB holds, so every read would wait for the
// page tables as well as for the data.
#pragma once

#include <cstddef>
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

}  // namespace lucerna
