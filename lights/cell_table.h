// Draws cells of a light field in proportion to their flux, in constant time.
//
// A cell is one interval of S times one pixel of M. The flux of the cells is factored into a chain of
// conditionals P(U_n), P(V_o | U_n), P(S_p | U_n V_o), P(T_q | U_n V_o S_p) [Goesele 2003, appendix B]. Each
// is a normalised 1D table that is inverted in advance: beside the cumulative sums, a guide table leads from
// u to the few entries that can be the answer. A draw reads four such tables regardless of the number of
// cells; the expected number of entries it compares is bounded by a constant [Chen and Asau 1974].
//
// The flux of a cell is the integral of max(0, h), not the sum of its coefficients, so that cells with
// negative coefficients emit what remains after clamping. A cell takes 4 bytes for the sums and about half a
// byte for the guide.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/huge_pages.h"
#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "lights/light.h"
#include "lights/light_field.h"

namespace lucerna {

// Holds many distributions over the same number of items, one per row.
class ConditionalTables {
  public:
    ConditionalTables() = default;
    // Requires items in [1, 65535].
    ConditionalTables(std::size_t rows, int items);

    // Sets one row. Weights are finite and not negative. Returns their sum; if it is 0, the row cannot be
    // drawn.
    double set(std::size_t row, const double* weights);

    struct Draw {
        int item;
        float probability;  // > 0 unless the row has no weight
        float remainder;    // of u, uniform in [0,1) again
    };
    // Requires u in [0,1). Items of weight 0 are never drawn. The result is an item of the row even if the
    // tables are corrupt.
    Draw draw(std::size_t row, float u) const { return finish(find(row, u), u); }
    // The two halves of draw(), for bulk draws: find() reads the tables, finish() computes the result.
    struct Step {
        std::int32_t item;
        float before, upto;  // P(item' < item), P(item' <= item)
    };
    Step find(std::size_t row, float u) const;
    static Draw finish(const Step& step, float u) {
        const float width = step.upto - step.before;
        const float rest = std::min(std::max((u - step.before) / width, 0.0F), kBelowOne);
        return {step.item, width, width > 0 ? rest : 0.0F};
    }
    // Prefetch what find(row, u) reads first and what it reads then.
    void fetch_guide(std::size_t row, float u) const { __builtin_prefetch(&guide_[guide_at(row, u)]); }
    void fetch_sums(std::size_t row, float u) const {
        __builtin_prefetch(&upto_[row * items_ + guide_[guide_at(row, u)]]);
    }
    float probability(std::size_t row, int item) const {
        const float* upto = &upto_[row * items_];
        return upto[item] - (item > 0 ? upto[item - 1] : 0.0F);
    }

    static std::uint64_t bytes_for(std::uint64_t rows, std::uint64_t items) {
        return (rows * items + kWindow) * sizeof(float) +
               rows * (buckets_for(items) + 1) * sizeof(std::uint16_t);
    }
    std::size_t bytes() const { return upto_.size() * sizeof(float) + guide_.size() * sizeof(std::uint16_t); }
    // Returns true if the tables could come from set(). It checks tables that are read from a file.
    bool sound() const;
    // For saving and loading.
    HugeVector<float>& upto() { return upto_; }
    HugeVector<std::uint16_t>& guide() { return guide_; }
    const HugeVector<float>& upto() const { return upto_; }
    const HugeVector<std::uint16_t>& guide() const { return guide_; }

  private:
    static constexpr std::size_t kItemsPerBucket = 4;
    static constexpr std::size_t kWindow = 8;  // entries compared at once, in one vector instruction
    static constexpr float kNothing = 0;

    static std::uint64_t buckets_for(std::uint64_t items) {
        return std::bit_ceil((items + kItemsPerBucket - 1) / kItemsPerBucket);
    }
    std::size_t guide_at(std::size_t row, float u) const {
        return row * (buckets_ + 1) + static_cast<std::size_t>(u * static_cast<float>(buckets_));
    }

    std::size_t items_ = 0;
    std::size_t buckets_ = 0;          // a power of 2, so that u * buckets is exact
    HugeVector<float> upto_;           // per row: upto[i] = P(item <= i), the last one 1. Padded at the end
    HugeVector<std::uint16_t> guide_;  // per row, buckets + 1: the first item with upto > bucket / buckets
};

inline ConditionalTables::Step ConditionalTables::find(std::size_t row, float u) const {
    const float* const upto = &upto_[row * items_];
    const std::uint16_t* const guide = &guide_[guide_at(row, u)];
    std::uint32_t from = guide[0];
    std::uint32_t to = guide[1];  // the answer is the first entry above u, in [from, to]
    // More than a window remains only where many improbable items share a bucket.
    while (to - from > kWindow) {
        const std::uint32_t middle = (from + to) / 2;
        if (upto[middle] > u)
            to = middle;
        else
            from = middle + 1;
    }
    // Counting avoids a branch, which would wait for memory and keep the next draw from starting.
    const std::uint32_t candidates = to - from;
    std::uint32_t below = 0;
    for (std::uint32_t k = 0; k < kWindow; ++k) {
        below += static_cast<std::uint32_t>(upto[from + k] <= u) & static_cast<std::uint32_t>(k < candidates);
    }
    from += below;
    const float* const previous = from > 0 ? &upto[from - 1] : &kNothing;
    return {static_cast<std::int32_t>(from), *previous, upto[from]};
}

class CellTable {
  public:
    // Throws InputError if there are more than 4·10⁹ cells. It cannot be interrupted; 10⁷ cells take about a
    // second.
    CellTable(const LightField& field, const Workers& workers, Monitor& monitor);

    struct Draw {
        Cell cell;
        CellId id;
        double probability;              // of this cell, > 0
        std::array<float, 4> remainder;  // of u, each uniform in [0,1) again
    };
    // Requires u in [0,1)⁴, for U, V, S and T, and flux() > 0.
    Draw draw(const std::array<float, 4>& u) const;

    // A block holds many draws in columns. Its results equal those of single draws, but memory reads overlap
    // and callers can process many draws in one instruction. For a table larger than the caches it is several
    // times as fast.
    struct Block {
        static constexpr std::size_t kSize = 64;
        template <typename T>
        using Column = std::array<T, kSize>;
        std::array<Column<float>, 4> u;   // input, for U, V, S, T, in [0,1)
        Column<std::int32_t> n, o, p, q;  // the cells
        Column<CellId> id;
        std::array<Column<float>, 4> link;       // probability of each conditional, > 0
        std::array<Column<float>, 4> remainder;  // of u

        double probability(std::size_t i) const {
            return double{link[0][i]} * double{link[1][i]} * double{link[2][i]} * double{link[3][i]};
        }
    };
    // Draws the first `size` columns, at most kSize.
    void draw(Block& block, std::size_t size) const;

    // Draws from the first two links of the chain only: an interval of S along each axis.
    struct IntervalDraw {
        int n, o;
        float probability;
        V2f remainder;
    };
    IntervalDraw draw_interval(const V2f& u) const;
    float interval_probability(int n, int o) const {
        return u_.probability(0, n) * v_.probability(static_cast<std::size_t>(n), o);
    }
    double probability(const Cell& cell) const;
    // Computes the probabilities of all cells of one interval, S slower than T; `out` has one entry per cell.
    void probabilities(int n, int o, std::span<float> out) const;

    CellId id(const Cell& c) const {
        return static_cast<CellId>(
            ((static_cast<std::size_t>(c.n) * size_[1] + static_cast<std::size_t>(c.o)) * size_[2] +
             static_cast<std::size_t>(c.p)) *
                size_[3] +
            static_cast<std::size_t>(c.q));
    }
    // Returns none if there is no such cell.
    std::optional<Cell> cell(CellId id) const;

    double flux() const { return flux_; }  // clamped, in the field's unit
    std::uint64_t field_hash() const { return hash_; }
    std::uint64_t cells() const { return std::uint64_t{size_[0]} * size_[1] * size_[2] * size_[3]; }
    std::size_t bytes() const { return u_.bytes() + v_.bytes() + s_.bytes() + t_.bytes(); }
    // Returns the size of a table for this rig without building it.
    static std::uint64_t bytes_for(const Rig& rig);

    // Throws InputError if the file cannot be written.
    void save(const std::filesystem::path& file) const;
    // Returns none and sets the reason unless the file holds a sound table of this very field.
    static std::optional<CellTable> load(const std::filesystem::path& file, const LightField& field,
                                         std::string& reason);
    // As above, for several tables in one file, one per slab of a lamp.
    static void save_all(const std::filesystem::path& file, std::span<const CellTable> tables);
    static std::optional<std::vector<CellTable>> load_all(const std::filesystem::path& file,
                                                          std::span<const LightField* const> fields,
                                                          std::string& reason);

  private:
    explicit CellTable(const LightField& field);  // sizes only
    void append_bytes(std::vector<std::byte>& header_bytes,
                      std::vector<std::span<const std::byte>>& parts) const;
    static std::optional<CellTable> read_next(std::istream& in, const LightField& field,
                                              std::uintmax_t& bytes_left, std::string& reason);
    void build(const LightField& field, const Workers& workers, Monitor& monitor);

    std::array<std::size_t, 4> size_{};
    double flux_ = 0;
    std::uint64_t hash_ = 0;
    ConditionalTables u_, v_, s_, t_;
};

// Returns the file of a lamp's tables: "lamp.cells" beside "lamp.exr".
std::filesystem::path cell_table_file(const std::filesystem::path& lamp);
// Returns one table for each field of the lamp in `lamp` (lamp.exr). They are loaded from the file beside it
// if that is sound and belongs to these fields; otherwise they are built and saved there. A folder that
// cannot be written causes a warning.
std::vector<CellTable> load_or_build_cell_tables(const std::filesystem::path& lamp,
                                                 std::span<const LightField* const> fields,
                                                 const Workers& workers, Monitor& monitor);

}  // namespace lucerna
