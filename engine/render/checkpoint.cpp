// The file: a head, then lines of text (facts and counts, "kind<tab>name<tab>value"), the tiles' samples, the
// film's sums and the allocation's state. In this machine's byte order; a check over all of it.
#include "engine/render/checkpoint.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>

#include "engine/base/error.h"
#include "engine/system/files.h"
#include "engine/system/hash.h"

namespace lucerna {
namespace {

constexpr char kMagic[8] = {'L', 'U', 'C', 'C', 'H', 'E', 'C', 'K'};
constexpr std::uint32_t kFormat = 3;
constexpr std::uint32_t kByteOrder = 0x01020304U;

struct Head {
    char magic[8];
    std::uint32_t format;
    std::uint32_t byte_order;
    std::uint64_t text;        // bytes
    std::uint64_t tiles;       // numbers
    std::uint64_t film;        // bytes
    std::uint64_t allocation;  // bytes
    std::uint64_t check;       // of all else
};
static_assert(sizeof(Head) == 56 && std::is_trivially_copyable_v<Head>, "no padding in the file");

std::uint64_t check_of(Head head, std::span<const std::span<const std::byte>> parts) {
    head.check = 0;
    WordHash check;
    check.add_bytes(std::as_bytes(std::span(&head, 1)));
    for (const auto part : parts) check.add_bytes(part);
    return check.value();
}

// --- the text ---

std::string text_of(const Checkpoint& checkpoint) {
    std::string text;
    const auto line = [&text](std::string_view kind, std::string_view name, const auto& value) {
        text += fmt::format("{}\t{}\t{}\n", kind, plain_line(name), value);
    };
    for (const auto& [name, value] : checkpoint.facts) line("fact", name, plain_line(value));
    for (const auto& [name, value] : checkpoint.numbers) line("number", name, value);
    for (const auto& [name, value] : checkpoint.notes) line("note", name, plain_line(value));
    line("state", "seconds", checkpoint.seconds);
    line("state", "samples", checkpoint.samples_done);
    line("state", "passes", checkpoint.passes_done);
    line("state", "rays", checkpoint.rays);
    line("state", "invalid rays", checkpoint.invalid_rays);
    line("state", "bad samples", checkpoint.bad_samples);
    line("state", "first bad", plain_line(checkpoint.first_bad));
    return text;
}

// The whole word as a number; false if it is none.
template <typename Number>
bool read_number(std::string_view word, Number& number) {
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    return error == std::errc() && end == word.data() + word.size();
}

bool read_state(std::string_view name, std::string_view value, Checkpoint& to) {
    if (name == "seconds") return read_number(value, to.seconds) && to.seconds >= 0 && to.seconds < 1e12;
    if (name == "samples") return read_number(value, to.samples_done) && to.samples_done >= 0;
    if (name == "passes") return read_number(value, to.passes_done) && to.passes_done >= 0;
    if (name == "rays") return read_number(value, to.rays);
    if (name == "invalid rays") return read_number(value, to.invalid_rays);
    if (name == "bad samples") return read_number(value, to.bad_samples);
    if (name == "first bad") to.first_bad = value;
    return name == "first bad";
}

bool read_line(std::string_view line, Checkpoint& to) {
    const std::size_t first = line.find('\t');
    const std::size_t second = first == line.npos ? line.npos : line.find('\t', first + 1);
    if (second == line.npos) return false;
    const std::string_view kind = line.substr(0, first);
    const std::string name(line.substr(first + 1, second - first - 1));
    const std::string_view value = line.substr(second + 1);
    if (kind == "fact") {
        to.facts.emplace_back(name, value);
    } else if (kind == "number") {
        return read_number(value, to.numbers[name]);
    } else if (kind == "note") {
        to.notes[name] = value;
    } else {
        return kind == "state" && read_state(name, value, to);
    }
    return true;
}

bool read_lines(std::string_view text, Checkpoint& to) {
    while (!text.empty()) {
        const std::size_t end = text.find('\n');
        if (end == text.npos || !read_line(text.substr(0, end), to)) return false;
        text.remove_prefix(end + 1);
    }
    return true;
}

// --- the head ---

// Head and length agree.
Head read_head(std::span<const std::byte> bytes, const Location& at) {
    Head head{};
    if (bytes.size() < sizeof head.magic || std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0) {
        input_error(at, "is not a checkpoint; expected a file written by lucerna render --checkpoint");
    }
    if (bytes.size() < sizeof head)
        input_error(at, "the checkpoint is truncated after {} bytes", bytes.size());
    std::memcpy(&head, bytes.data(), sizeof head);
    if (head.byte_order != kByteOrder) {
        input_error(at, "the checkpoint was written on a machine with another byte order");
    }
    if (head.format != kFormat) {
        input_error(at, "the checkpoint is from a {} version of lucerna: format {}; expected {}",
                    head.format > kFormat ? "newer" : "older", head.format, kFormat);
    }
    // None of these may make the sum wrap around.
    const std::uint64_t left = bytes.size() - sizeof head;
    const bool fits = head.text <= left && head.tiles <= left / sizeof(std::int32_t) && head.film <= left &&
                      head.allocation <= left;
    const std::uint64_t told = head.text + head.tiles * sizeof(std::int32_t) + head.film + head.allocation;
    if (!fits || told > left) {
        input_error(at, "the checkpoint is truncated or damaged: it holds {} bytes, its header states more",
                    bytes.size());
    }
    if (told < left) input_error(at, "the checkpoint is damaged: {} bytes too long", left - told);
    return head;
}

[[noreturn]] void damaged(const Location& at) {
    throw InputError(at, "the checkpoint is damaged; use an earlier one, or render from the start");
}

}  // namespace

void save_checkpoint(const std::filesystem::path& file, const Checkpoint& checkpoint) {
    const std::string text = text_of(checkpoint);
    Head head{};
    std::memcpy(head.magic, kMagic, sizeof kMagic);
    head.format = kFormat;
    head.byte_order = kByteOrder;
    head.text = text.size();
    head.tiles = checkpoint.tiles.size();
    head.film = checkpoint.film.size();
    head.allocation = checkpoint.allocation.size();
    const std::array<std::span<const std::byte>, 5> all{
        std::as_bytes(std::span(&head, 1)), std::as_bytes(std::span(text)),
        std::as_bytes(std::span(checkpoint.tiles)), std::span(checkpoint.film),
        std::span(checkpoint.allocation)};
    head.check = check_of(head, std::span(all).subspan(1));
    replace_file(file, all);
}

Checkpoint load_checkpoint(const std::filesystem::path& file) {
    const Location at{file.string()};
    std::vector<std::byte> bytes = read_bytes(file);
    const Head head = read_head(bytes, at);
    const std::span<const std::byte> rest = std::span(bytes).subspan(sizeof head);
    const auto text = rest.first(head.text);
    const auto tiles = rest.subspan(head.text, head.tiles * sizeof(std::int32_t));
    const auto film = rest.subspan(head.text + tiles.size(), head.film);
    const auto allocation = rest.subspan(head.text + tiles.size() + film.size());
    const std::array<std::span<const std::byte>, 4> parts{text, tiles, film, allocation};
    if (head.check != check_of(head, parts)) damaged(at);

    Checkpoint checkpoint;
    if (!read_lines({reinterpret_cast<const char*>(text.data()), text.size()}, checkpoint)) damaged(at);
    checkpoint.tiles.resize(head.tiles);
    if (!tiles.empty()) std::memcpy(checkpoint.tiles.data(), tiles.data(), tiles.size());
    for (const std::int32_t samples : checkpoint.tiles) {
        if (samples < checkpoint.samples_done) damaged(at);
    }
    checkpoint.film.assign(film.begin(), film.end());
    checkpoint.allocation.assign(allocation.begin(), allocation.end());
    return checkpoint;
}

void require_same(const std::filesystem::path& file, const Facts& made_with, const Facts& facts) {
    const auto difference = first_difference(made_with, facts);
    if (!difference) return;
    input_error({file.string()},
                "the checkpoint is from a different render: its {} is {}, here it is {}; only the number of "
                "threads, time, error and a higher number of samples may differ",
                difference->name, difference->of_first, difference->of_second);
}

}  // namespace lucerna
