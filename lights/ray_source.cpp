#include "lights/ray_source.h"

#include <charconv>

#include "engine/system/memory.h"
#include "lights/photometric_files.h"
#include "lights/ray_set.h"

namespace lucerna {

RaySource::RaySource(UnpackedFile file) : file_(std::move(file)), at_{file_.name()}, left_(file_.size()) {}

std::string RaySource::name() const {
    return std::filesystem::path(at_.file).filename().string();
}

void RaySource::require_left(std::uint64_t bytes, const char* what) const {
    if (bytes <= left_) return;
    input_error(at_, "truncated in the {}: {} bytes expected at byte {}, {} left", what, bytes, offset_,
                left_);
}

void RaySource::read(void* to, std::uint64_t bytes, const char* what) {
    require_left(bytes, what);
    file_.read(to, bytes);
    left_ -= bytes;
    offset_ += bytes;
}

void RaySource::skip(std::uint64_t bytes, const char* what) {
    require_left(bytes, what);
    file_.skip(bytes);
    left_ -= bytes;
    offset_ += bytes;
}

void RaySource::require_rows(std::uint64_t rays, std::size_t floats, bool coloured) const {
    const std::uint64_t row_bytes = floats * sizeof(float);  // > 0, as a row has at least a position
    if (rays == 0) throw InputError(at_, "the file states 0 rays; expected at least one");
    if (rays > left_ / row_bytes) {
        input_error(at_, "truncated in the rays: {} rays of {} bytes stated, {} bytes left at byte {}", rays,
                    row_bytes, left_, offset_);
    }
    require_ray_memory(rays, coloured, at_);
}

void require_ray_memory(std::uint64_t rays, bool coloured, const Location& at) {
    const std::size_t ray_bytes = sizeof(LampRay) + (coloured ? sizeof(V3f) + sizeof(std::uint16_t) : 0);
    require_memory(bytes_of(rays, ray_bytes), fmt::format("{}: {} rays", to_string(at), rays),
                   "use fewer rays");
}

std::string ascii_text(std::span<const std::byte> bytes) {
    std::string text;
    for (const std::byte b : bytes) {
        if (b == std::byte{0}) break;
        const char c = static_cast<char>(b);
        text += c >= ' ' && c <= '~' ? c : ' ';
    }
    while (!text.empty() && text.back() == ' ') text.pop_back();
    return text;
}

bool RayLines::next(std::string_view& line) {
    constexpr std::size_t kBlock = 1 << 16, kLongest = 4096;
    while (true) {
        std::size_t end = buffer_.find('\n', begin_);
        if (end == buffer_.npos && source_.left() > 0) {
            if (buffer_.size() - begin_ > kLongest)
                input_error({source_.at().file, number_ + 1, 1}, "a line of more than {} characters",
                            kLongest);
            buffer_.erase(0, begin_);
            begin_ = 0;
            const std::size_t kept = buffer_.size();
            buffer_.resize(kept + std::min<std::uint64_t>(kBlock, source_.left()));
            source_.read(buffer_.data() + kept, buffer_.size() - kept, "rays");
            continue;
        }
        if (begin_ == buffer_.size()) return false;
        end = std::min(end, buffer_.size());
        line = std::string_view(buffer_).substr(begin_, end - begin_);
        begin_ = std::min(end + 1, buffer_.size());
        ++number_;
        if (line.ends_with('\r')) line.remove_suffix(1);
        if (line.find_first_not_of(" \t") != line.npos) return true;
    }
}

namespace {

float float_of(std::string_view word, const Location& at, std::string_view expected) {
    std::string_view digits = word;
    if (digits.size() > 1 && digits[0] == '+') digits.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error == std::errc::invalid_argument || end != digits.data() + digits.size())
        input_error(at, "\"{}\" is not a number; expected {}", shown_value(word), expected);
    return static_cast<float>(value);
}

}  // namespace

std::size_t read_numbers(std::string_view line, std::string_view separators, std::span<float> row,
                         const Location& at, std::string_view expected) {
    constexpr std::string_view kBlanks = " \t";
    const bool blanks_separate = kBlanks.find(separators[0]) != kBlanks.npos;
    std::size_t count = 0;
    for (std::size_t begin = line.find_first_not_of(kBlanks); begin != line.npos;) {
        const std::size_t end = std::min(line.find_first_of(separators, begin), line.size());
        std::string_view word = line.substr(begin, end - begin);
        if (!blanks_separate) word.remove_suffix(word.size() - 1 - word.find_last_not_of(kBlanks));
        const float value = float_of(word, at, expected);
        if (count < row.size()) row[count] = value;
        ++count;
        // Separators that are not blanks stand alone: an empty word between two is not a number.
        begin = line.find_first_not_of(kBlanks, blanks_separate ? end : std::min(end + 1, line.size()));
    }
    return count;
}

double metres_of_unit(std::int32_t number, std::span<const NamedUnit> units, const Location& at) {
    if (number >= 0 && static_cast<std::size_t>(number) < units.size()) {
        return units[static_cast<std::size_t>(number)].metres;
    }
    std::string accepted;
    for (std::size_t i = 0; i < units.size(); ++i) {
        accepted += fmt::format("{}{} ({})", i == 0 ? "" : ", ", i, units[i].name);
    }
    input_error(at, "length unit {}; expected {}", number, accepted);
}

}  // namespace lucerna
