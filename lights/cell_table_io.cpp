// The cell table's file is a cache beside the lamp, written by us in this machine's byte order and never
// trusted. For a lamp of several slabs it holds their tables one after the other.
#include <bit>
#include <cstring>
#include <fstream>
#include <span>
#include <vector>

#include "engine/base/error.h"
#include "engine/system/files.h"
#include "engine/system/hash.h"
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
    std::uint64_t check;  // hash of the flux and everything that follows
};
static_assert(sizeof(FileHeader) == 72, "no padding in the file");

// Calls action(bytes) for every array of the four tables, in file order.
template <typename Action>
void for_each_array(std::span<ConditionalTables* const> tables, Action&& action) {
    for (ConditionalTables* table : tables) {
        action(std::as_writable_bytes(std::span(table->upto())));
        action(std::as_writable_bytes(std::span(table->guide())));
    }
}

// Returns false for anything else of that name, even a pipe.
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

// Appends a table's bytes in file order: its header, whose buffer must outlive `parts`, and its arrays.
void CellTable::append_bytes(std::vector<std::byte>& header_bytes,
                             std::vector<std::span<const std::byte>>& parts) const {
    CellTable& self = const_cast<CellTable&>(*this);  // only read; both ways share one list
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
    header_bytes.resize(sizeof header);
    std::memcpy(header_bytes.data(), &header, sizeof header);
    parts.push_back(header_bytes);
    for_each_array(tables, [&](std::span<const std::byte> bytes) { parts.push_back(bytes); });
}

void CellTable::save(const std::filesystem::path& file) const {
    save_all(file, {this, 1});
}

void CellTable::save_all(const std::filesystem::path& file, std::span<const CellTable> tables) {
    std::vector<std::vector<std::byte>> headers(tables.size());
    std::vector<std::span<const std::byte>> parts;
    for (std::size_t i = 0; i < tables.size(); ++i) tables[i].append_bytes(headers[i], parts);
    replace_file(file, parts);
}

// Reads the next table of a file. Returns none and sets the reason if it is not sound.
std::optional<CellTable> CellTable::read_next(std::istream& in, const LightField& field,
                                              std::uintmax_t& bytes_left, std::string& reason) {
    const auto refuse = [&reason](const char* why) {
        reason = why;
        return std::nullopt;
    };
    FileHeader header{};
    in.read(reinterpret_cast<char*>(&header), sizeof header);
    if (!in || std::memcmp(header.magic, kMagic, sizeof kMagic) != 0) return refuse("it is not a cell table");
    if (header.version != kCellTableVersion || header.byte_order != kByteOrder)
        return refuse("it is of another version");

    CellTable table(field);
    if (header.field_hash != table.hash_) return refuse("it belongs to another light field");
    for (std::size_t i = 0; i < 4; ++i) {
        if (header.size[i] != table.size_[i]) return refuse("it belongs to another light field");
    }
    const std::uintmax_t wanted = sizeof header + table.bytes();
    if (bytes_left < wanted) return refuse("its length is wrong");
    bytes_left -= wanted;
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

std::optional<std::vector<CellTable>> CellTable::load_all(const std::filesystem::path& file,
                                                          std::span<const LightField* const> fields,
                                                          std::string& reason) {
    const auto refuse = [&reason](const char* why) {
        reason = why;
        return std::nullopt;
    };
    std::error_code status;
    if (!std::filesystem::exists(file, status)) return refuse("there is none");
    std::uintmax_t bytes_left = std::filesystem::file_size(file, status);
    if (!is_cell_table(file)) return refuse("it is not a cell table");
    std::ifstream in = open_to_read(file);
    std::vector<CellTable> tables;
    for (const LightField* field : fields) {
        std::optional<CellTable> table = read_next(in, *field, bytes_left, reason);
        if (!table) return std::nullopt;
        tables.push_back(std::move(*table));
    }
    if (bytes_left != 0) return refuse("its length is wrong");
    return tables;
}

std::optional<CellTable> CellTable::load(const std::filesystem::path& file, const LightField& field,
                                         std::string& reason) {
    const LightField* const fields[] = {&field};
    auto tables = load_all(file, fields, reason);
    return tables ? std::optional(std::move(tables->front())) : std::nullopt;
}

std::filesystem::path cell_table_file(const std::filesystem::path& lamp) {
    std::filesystem::path file = lamp;
    return file.replace_extension(".cells");
}

std::vector<CellTable> load_or_build_cell_tables(const std::filesystem::path& lamp,
                                                 std::span<const LightField* const> fields,
                                                 const Workers& workers, Monitor& monitor) {
    const std::filesystem::path file = cell_table_file(lamp);
    std::string reason;
    if (auto tables = CellTable::load_all(file, fields, reason)) return std::move(*tables);
    monitor.info(fmt::format("{}: building the cell table ({})", file.string(), reason));
    std::vector<CellTable> tables;
    for (const LightField* field : fields) tables.emplace_back(*field, workers, monitor);
    std::error_code status;
    if (std::filesystem::exists(std::filesystem::symlink_status(file, status)) && !is_cell_table(file)) {
        monitor.warn(fmt::format(
            "{}: is not a cell table; it is left as it is, and the lamp's cell table is not saved",
            file.string()));
        return tables;
    }
    try {
        CellTable::save_all(file, tables);
    } catch (const InputError& error) {
        monitor.warn(fmt::format("the cell table is not saved: {}", error.what()));
    }
    return tables;
}

}  // namespace lucerna
