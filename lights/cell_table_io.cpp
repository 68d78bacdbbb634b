// The cell table's file: a cache beside the lamp, made by us, for this machine's byte order, never trusted.
#include <bit>
#include <cstring>
#include <fstream>
#include <span>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/files.h"
#include "lights/cell_table.h"

namespace lucerna {
namespace {

constexpr char kMagic[8] = {'L', 'U', 'C', 'C', 'E', 'L', 'L', 'S'};
constexpr std::uint32_t kCellTableVersion = 1;
constexpr std::uint32_t kByteOrder = 0x01020304;

struct FileHeader {
    char magic[8];
    std::uint32_t version, byte_order;
    std::uint64_t field_hash;
    std::uint64_t size[4];
    double flux;
    std::uint64_t check;  // of the flux and of all that follows
};
static_assert(sizeof(FileHeader) == 72, "no padding in the file");

// Calls action(bytes) for every array of the four tables, in the order in which they lie in the file.
template <typename Action>
void for_each_array(std::span<ConditionalTables* const> tables, Action&& action) {
    for (ConditionalTables* table : tables) {
        action(std::as_writable_bytes(std::span(table->upto())));
        action(std::as_writable_bytes(std::span(table->guide())));
    }
}

// Or something else that happens to have the name of one, which may be anything: a pipe, too.
bool is_cell_table(const std::filesystem::path& file) {
    try {
        std::ifstream in = open_to_read(file);
        char magic[sizeof kMagic] = {};
        in.read(magic, sizeof magic);
        return in && std::memcmp(magic, kMagic, sizeof kMagic) == 0;
    } catch (const InputError&) {
        return false;
    }
}

}  // namespace

void CellTable::save(const std::filesystem::path& file) const {
    CellTable& self = const_cast<CellTable&>(*this);  // only read; one list of arrays serves both ways
    ConditionalTables* const tables[] = {&self.u_, &self.v_, &self.s_, &self.t_};
    FileHeader header{};
    std::memcpy(header.magic, kMagic, sizeof kMagic);
    header.version = kCellTableVersion;
    header.byte_order = kByteOrder;
    header.field_hash = hash_;
    for (std::size_t i = 0; i < 4; ++i) header.size[i] = size_[i];
    header.flux = flux_;
    WordHash check;
    check.add(header.flux);
    for_each_array(tables, [&](std::span<const std::byte> bytes) { check.add_bytes(bytes); });
    header.check = check.value();
    std::vector<std::span<const std::byte>> parts{std::as_bytes(std::span(&header, 1))};
    for_each_array(tables, [&](std::span<const std::byte> bytes) { parts.push_back(bytes); });
    replace_file(file, parts);
}

std::optional<CellTable> CellTable::load(const std::filesystem::path& file, const LightField& field,
                                         std::string& reason) {
    const auto refuse = [&reason](const char* why) {
        reason = why;
        return std::nullopt;
    };
    std::error_code status;
    if (!std::filesystem::exists(file, status)) return refuse("there is none");
    const std::uintmax_t bytes_there = std::filesystem::file_size(file, status);
    if (!is_cell_table(file)) return refuse("it is no cell table");
    std::ifstream in = open_to_read(file);
    FileHeader header{};
    in.read(reinterpret_cast<char*>(&header), sizeof header);
    if (!in) return refuse("it is no cell table");
    if (header.version != kCellTableVersion || header.byte_order != kByteOrder)
        return refuse("it is of another version");

    CellTable table(field);
    if (header.field_hash != table.hash_) return refuse("it belongs to another light field");
    for (std::size_t i = 0; i < 4; ++i) {
        if (header.size[i] != table.size_[i]) return refuse("it belongs to another light field");
    }
    if (bytes_there != sizeof header + table.bytes()) return refuse("its length is wrong");
    ConditionalTables* const tables[] = {&table.u_, &table.v_, &table.s_, &table.t_};
    WordHash check;
    check.add(header.flux);
    for_each_array(tables, [&](std::span<std::byte> bytes) {
        in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
        check.add_bytes(bytes);
    });
    if (!in || check.value() != header.check) return refuse("it is damaged");
    if (!std::isfinite(header.flux) || header.flux < 0) return refuse("it is damaged");
    for (const ConditionalTables* t : tables) {
        if (!t->sound()) return refuse("it is damaged");
    }
    table.flux_ = header.flux;
    return table;
}

std::filesystem::path cell_table_file(const std::filesystem::path& lamp) {
    std::filesystem::path file = lamp;
    return file.replace_extension(".cells");
}

CellTable load_or_build_cell_table(const std::filesystem::path& lamp, const LightField& field,
                                   const Workers& workers, Monitor& monitor) {
    const std::filesystem::path file = cell_table_file(lamp);
    std::string reason;
    if (auto table = CellTable::load(file, field, reason)) return std::move(*table);
    monitor.info(fmt::format("{}: building the cell table ({})", file.string(), reason));
    CellTable table(field, workers, monitor);
    std::error_code status;
    if (std::filesystem::exists(std::filesystem::symlink_status(file, status)) && !is_cell_table(file)) {
        monitor.warn(
            fmt::format("{}: is no cell table; it stays, and the lamp's is not kept", file.string()));
        return table;
    }
    try {
        table.save(file);
    } catch (const InputError& error) {
        monitor.warn(fmt::format("the cell table is not kept: {}", error.what()));
    }
    return table;
}

}  // namespace lucerna
