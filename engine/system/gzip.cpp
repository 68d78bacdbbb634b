#include "engine/system/gzip.h"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>

#include "engine/base/error.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

constexpr std::size_t kMostTimes = 400, kAnyTimes = std::size_t{64} << 20;

}  // namespace

bool is_packed_trap(std::size_t made, std::size_t packed) {
    return made > kAnyTimes && made / kMostTimes > packed;
}

void refuse_packed_trap(const std::string& file) {
    input_error({file}, "expands to more than {} times its size; such files may be at most {} MiB",
                kMostTimes, kAnyTimes >> 20);
}

GzipReader::GzipReader(const std::filesystem::path& file) : file_(file), in_(nullptr, gzclose) {
    require_readable(file);
    in_.reset(gzopen(file.c_str(), "rb"));
    if (!in_) throw InputError({file.string()}, std::string("cannot be opened: ") + std::strerror(errno));
    gzbuffer(in_.get(), 1 << 18);
}

bool GzipReader::packed() const {
    return gzdirect(in_.get()) == 0;
}

std::size_t GzipReader::read(void* to, std::size_t bytes) {
    constexpr std::size_t kStep = std::size_t{1} << 26;  // zlib counts in 32 bits
    std::size_t done = 0;
    for (int got = 1; got > 0 && done < bytes; done += static_cast<std::size_t>(std::max(got, 0))) {
        if (packed() && is_packed_trap(made_ + done, static_cast<std::size_t>(gzoffset(in_.get()))))
            refuse_packed_trap(file_.string());
        got = gzread(in_.get(), static_cast<std::byte*>(to) + done,
                     static_cast<unsigned>(std::min(kStep, bytes - done)));
    }
    made_ += done;
    int state = Z_OK;
    gzerror(in_.get(), &state);
    if (state == Z_ERRNO) throw InputError({file_.string()}, "reading failed before the end of the file");
    if (state == Z_BUF_ERROR) throw InputError({file_.string()}, "its compressed data end too early");
    if (state != Z_OK && state != Z_STREAM_END)
        throw InputError({file_.string()}, "its compressed data are damaged");
    return done;
}

void GzipReader::rewind() {
    gzrewind(in_.get());
    made_ = 0;
}

}  // namespace lucerna
