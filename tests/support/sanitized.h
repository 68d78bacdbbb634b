// Tells whether a memory sanitizer is active: it reserves more addresses than any limit would allow, and
// retains freed memory.
#pragma once

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)  // gcc
#define LUCERNA_SANITIZED
#elif defined(__has_feature)  // clang
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define LUCERNA_SANITIZED
#endif
#endif

namespace lucerna::testing {

#ifdef LUCERNA_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace lucerna::testing
