#include "engine/cli/light/sums_file.h"

#include <cstring>
#include <fstream>
#include <span>
#include <type_traits>

#include "engine/base/error.h"
#include "engine/system/files.h"
#include "engine/system/hash.h"
#include "lights/measurement/acquire.h"

namespace lucerna {
namespace {

constexpr char kMagic[8] = {'L', 'U', 'C', 'S', 'U', 'M', 'S', '2'};
constexpr std::uint64_t kByteOrder = 0x0102030405060708;

constexpr std::size_t kNumbers = 7 * 3 + 5 + 3;
constexpr std::size_t kCounts = 4;

// A state without its arrays, of which there are two, or six for several colours.
struct Head {
    char magic[8];
    std::uint64_t byte_order;
    std::uint64_t key;
    std::int64_t blocks;
    std::uint64_t coefficients;
    double numbers[kNumbers];
    std::uint64_t counts[kCounts];
    std::uint64_t check;  // checksum of the numbers, the counts and the following arrays
};
static_assert(sizeof(Head) == 8 * (6 + kNumbers + kCounts) && std::is_trivially_copyable_v<Head>,
              "no padding in the file");

// Calls number(double&) and count(std::uint64_t&) for all entries of the head, for reading and writing.
template <typename Number, typename Count>
void for_each_entry(AcquisitionState& state, Number&& number, Count&& count) {
    Ledger& ledger = state.flux.ledger;
    for (V3d* entry : {&ledger.emitted, &ledger.absorbed, &ledger.escaped, &ledger.cut, &ledger.roulette,
                       &state.flux.forward, &state.flux.backward}) {
        for (int c = 0; c < 3; ++c) number((*entry)[c]);
    }
    FluxAccount& account = state.sums.account;
    for (double* entry : {&account.backward, &account.beside_s, &account.beside_m, &account.not_in_basis,
                          &state.sums.squares}) {
        number(*entry);
    }
    for (int c = 0; c < 3; ++c) {
        auto component = double{state.sums.tint[c]};
        number(component);
        state.sums.tint[c] = static_cast<float>(component);
    }
    for (std::uint64_t* entry : {&ledger.paths, &ledger.not_emitted, &ledger.hits}) count(*entry);
    std::uint64_t coloured = state.sums.coloured() ? 1 : 0;
    count(coloured);
    if (coloured == 1) state.sums.separate_colours();
}

std::vector<std::vector<double>*> arrays_of(FilterSums& sums) {
    std::vector<std::vector<double>*> arrays{&sums.positive, &sums.negative};
    if (sums.coloured())
        arrays.insert(arrays.end(), {&sums.x.positive, &sums.x.negative, &sums.z.positive, &sums.z.negative});
    return arrays;
}

std::uint64_t check_of(const Head& head, FilterSums& sums) {
    WordHash check;
    check.add(static_cast<std::uint64_t>(head.blocks));
    for (const double number : head.numbers) check.add(number);
    for (const std::uint64_t count : head.counts) check.add(count);
    for (const std::vector<double>* array : arrays_of(sums))
        for (const double sum : *array) check.add(sum);
    return check.value();
}

[[noreturn]] void damaged(const std::filesystem::path& file) {
    throw InputError({file.string()},
                     "is damaged or not an unfinished acquisition; remove it to start again");
}

}  // namespace

void save_state(const std::filesystem::path& file, const AcquisitionState& state) {
    Head head{};
    std::memcpy(head.magic, kMagic, sizeof kMagic);
    head.byte_order = kByteOrder;
    head.key = state.key;
    head.blocks = state.blocks;
    head.coefficients = state.sums.positive.size();
    std::size_t number = 0;
    std::size_t count = 0;
    auto& read = const_cast<AcquisitionState&>(state);  // not modified
    for_each_entry(
        read, [&](double& x) { head.numbers[number++] = x; },
        [&](std::uint64_t& x) { head.counts[count++] = x; });
    head.check = check_of(head, read.sums);
    std::vector<std::span<const std::byte>> parts{std::as_bytes(std::span(&head, 1))};
    for (const std::vector<double>* array : arrays_of(read.sums))
        parts.push_back(std::as_bytes(std::span(*array)));
    replace_file(file, parts);
}

std::optional<AcquisitionState> load_state(const std::filesystem::path& file, std::uint64_t key,
                                           const Rig& rig) {
    std::error_code status;
    if (!std::filesystem::exists(std::filesystem::symlink_status(file, status))) return std::nullopt;
    require_own_part(file);
    std::ifstream in = open_to_read(file);
    Head head{};
    in.read(reinterpret_cast<char*>(&head), sizeof head);
    if (!in || std::memcmp(head.magic, kMagic, sizeof kMagic) != 0 || head.byte_order != kByteOrder)
        damaged(file);
    if (head.blocks == 0) return std::nullopt;  // stopped before the first block
    if (head.key != key || head.coefficients != rig.coefficients()) {
        throw InputError({file.string()},
                         "belongs to another luminaire, rig, seed or number of rays; finish that acquisition "
                         "with its own description, or remove the file to start again");
    }
    // Uses the caller's rig, so that the file does not determine the allocation.
    AcquisitionState state{key, head.blocks, {}, FilterSums(rig)};
    std::size_t number = 0;
    std::size_t count = 0;
    for_each_entry(
        state, [&](double& x) { x = head.numbers[number++]; },
        [&](std::uint64_t& x) { x = head.counts[count++]; });
    for (std::vector<double>* array : arrays_of(state.sums)) {
        in.read(reinterpret_cast<char*>(array->data()),
                static_cast<std::streamsize>(array->size() * sizeof(double)));
    }
    if (!in || in.peek() != std::ifstream::traits_type::eof() || head.blocks < 0 ||
        head.check != check_of(head, state.sums)) {
        damaged(file);
    }
    return state;
}

}  // namespace lucerna
