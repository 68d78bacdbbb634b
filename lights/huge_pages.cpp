#include "lights/huge_pages.h"

#include <cstdlib>
#include <new>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace lucerna {
namespace {

constexpr std::size_t kHugePage = std::size_t{1} << 21;
constexpr std::size_t kCacheLine = 64;

}  // namespace

void* allocate_in_huge_pages(std::size_t bytes) {
    const std::size_t unit = bytes >= kHugePage ? kHugePage : kCacheLine;
    const std::size_t rounded = (bytes + unit - 1) / unit * unit;  // aligned_alloc needs a multiple
    void* memory = std::aligned_alloc(unit, rounded);
    if (memory == nullptr && rounded > 0) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
    // Advice only: if it is refused, pages are small and nothing else changes.
    if (unit == kHugePage) static_cast<void>(madvise(memory, rounded, MADV_HUGEPAGE));
#endif
    return memory;
}

void free_huge_pages(void* memory) {
    std::free(memory);
}

}  // namespace lucerna
