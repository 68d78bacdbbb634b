#include "engine/base/huge_pages.h"

#include <cstdint>
#include <cstdlib>
#include <new>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace lucerna {
namespace {

constexpr std::size_t kHugePage = std::size_t{1} << 21;
constexpr std::size_t kCacheLine = 64;

std::size_t rounded_up(std::size_t bytes, std::size_t unit) {
    return (bytes + unit - 1) / unit * unit;
}

}  // namespace

void* allocate_in_huge_pages(std::size_t bytes) {
    const std::size_t unit = bytes >= kHugePage ? kHugePage : kCacheLine;
    const std::size_t rounded = rounded_up(bytes, unit);  // aligned_alloc needs a multiple
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

#ifdef MADV_HUGEPAGE

// Maps large blocks anew: the C library would zero memory that it has had before by one thread.
void* allocate_zeroed(std::size_t count, std::size_t each) {
    const std::size_t bytes = count * each;
    if (bytes < kHugePage) {
        void* const memory = std::calloc(count, each);
        if (memory == nullptr && bytes > 0) throw std::bad_alloc();
        return memory;
    }
    // A mapping begins anywhere: what is before and after the huge pages is returned.
    const std::size_t whole = rounded_up(bytes, kHugePage), mapped = whole + kHugePage;
    void* const mapping = mmap(nullptr, mapped, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (mapping == MAP_FAILED) throw std::bad_alloc();
    auto* const first = static_cast<std::byte*>(mapping);
    const std::size_t before = (kHugePage - reinterpret_cast<std::uintptr_t>(first) % kHugePage) % kHugePage;
    if (before > 0) munmap(first, before);
    std::byte* const memory = first + before;
    munmap(memory + whole, kHugePage - before);
    static_cast<void>(madvise(memory, whole, MADV_HUGEPAGE));
    return memory;
}

void free_zeroed(void* memory, std::size_t bytes) {
    if (bytes < kHugePage) {
        std::free(memory);
    } else {
        munmap(memory, rounded_up(bytes, kHugePage));
    }
}

#else

void* allocate_zeroed(std::size_t count, std::size_t each) {
    void* const memory = std::calloc(count, each);
    if (memory == nullptr && count * each > 0) throw std::bad_alloc();
    return memory;
}

void free_zeroed(void* memory, std::size_t /*bytes*/) {
    std::free(memory);
}

#endif

}  // namespace lucerna
