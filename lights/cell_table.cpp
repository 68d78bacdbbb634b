#include "lights/cell_table.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "engine/base/error.h"
#include "engine/system/memory.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kMaxCells = 4'000'000'000U;  // CellId reserves its largest value for "no cell"

}  // namespace

ConditionalTables::ConditionalTables(std::size_t rows, int items)
    : items_(static_cast<std::size_t>(items)),
      buckets_(buckets_for(items_)),
      upto_(rows * items_ + kWindow),
      guide_(rows * (buckets_ + 1)) {}

double ConditionalTables::set(std::size_t row, const double* weights) {
    float* upto = &upto_[row * items_];
    std::uint16_t* guide = &guide_[row * (buckets_ + 1)];
    double total = 0;
    for (std::size_t i = 0; i < items_; ++i) total += weights[i];
    double sum = 0;
    for (std::size_t i = 0; i < items_; ++i) {
        sum += weights[i];
        // Both sums add in the same order, so the last one equals `total` and the last quotient is 1.
        upto[i] = total > 0 ? static_cast<float>(sum / total) : 0.0F;
    }
    std::size_t i = 0;
    for (std::size_t b = 0; b <= buckets_; ++b) {
        const float threshold = static_cast<float>(b) / static_cast<float>(buckets_);
        while (i + 1 < items_ && upto[i] <= threshold) ++i;
        guide[b] = static_cast<std::uint16_t>(i);
    }
    return total;
}

bool ConditionalTables::sound() const {
    if (items_ == 0 || upto_.size() < kWindow || (upto_.size() - kWindow) % items_ != 0) return false;
    const std::size_t rows = (upto_.size() - kWindow) / items_;
    if (guide_.size() != rows * (buckets_ + 1)) return false;
    for (std::size_t row = 0; row < rows; ++row) {
        const float* upto = &upto_[row * items_];
        float before = 0;
        for (std::size_t i = 0; i < items_; ++i) {
            if (!(upto[i] >= before && upto[i] <= 1)) return false;  // also refuses NaN
            before = upto[i];
        }
        if (before != 0 && before != 1) return false;
        const std::uint16_t* guide = &guide_[row * (buckets_ + 1)];
        for (std::size_t b = 0; b <= buckets_; ++b) {
            if (guide[b] >= items_ || (b > 0 && guide[b] < guide[b - 1])) return false;
        }
    }
    return true;
}

CellTable::CellTable(const LightField& field) {
    const Rig& rig = field.rig();
    size_ = {static_cast<std::size_t>(rig.intervals(0)), static_cast<std::size_t>(rig.intervals(1)),
             static_cast<std::size_t>(rig.columns(0)), static_cast<std::size_t>(rig.columns(1))};
    // Each size is below 65536 (Rig::fault), so the product fits 64 bits.
    if (cells() > kMaxCells) {
        throw InputError(fmt::format("light field: {} x {} x {} x {} cells; a cell table holds at most {}",
                                     size_[0], size_[1], size_[2], size_[3], kMaxCells));
    }
    require_memory(bytes_for(rig), fmt::format("a cell table of {} cells", cells()),
                   "use a lamp of fewer coefficients");
    hash_ = content_hash(field);
    u_ = ConditionalTables(1, static_cast<int>(size_[0]));
    v_ = ConditionalTables(size_[0], static_cast<int>(size_[1]));
    s_ = ConditionalTables(size_[0] * size_[1], static_cast<int>(size_[2]));
    t_ = ConditionalTables(size_[0] * size_[1] * size_[2], static_cast<int>(size_[3]));
}

std::uint64_t CellTable::bytes_for(const Rig& rig) {
    std::uint64_t rows = 1, bytes = 0;
    for (const int items : {rig.intervals(0), rig.intervals(1), rig.columns(0), rig.columns(1)}) {
        bytes += ConditionalTables::bytes_for(rows, static_cast<std::uint64_t>(items));
        rows *= static_cast<std::uint64_t>(items);  // each below 65536
    }
    return bytes;
}

CellTable::CellTable(const LightField& field, const Workers& workers, Monitor& monitor) : CellTable(field) {
    build(field, workers, monitor);
}

void CellTable::build(const LightField& field, const Workers& workers, Monitor& monitor) {
    const std::size_t pairs = size_[0] * size_[1];
    Phase phase(monitor, "cell table", pairs);
    std::vector<double> pair_sum(pairs);
    parallel_ranges(workers, static_cast<std::int64_t>(pairs), 1,
                    [&](std::int64_t at, std::int64_t, std::int64_t) {
                        const auto pair = static_cast<std::size_t>(at);
                        std::vector<double> row(size_[3]);
                        std::vector<double> row_sum(size_[2]);
                        Cell cell{static_cast<int>(pair / size_[1]), static_cast<int>(pair % size_[1]), 0, 0};
                        for (cell.p = 0; cell.p < static_cast<int>(size_[2]); ++cell.p) {
                            for (cell.q = 0; cell.q < static_cast<int>(size_[3]); ++cell.q) {
                                row[static_cast<std::size_t>(cell.q)] = field.members(cell).clamped_mean();
                            }
                            const auto p = static_cast<std::size_t>(cell.p);
                            row_sum[p] = t_.set(pair * size_[2] + p, row.data());
                        }
                        pair_sum[pair] = s_.set(pair, row_sum.data());
                        phase.advance(1);
                    });
    std::vector<double> sum(size_[0]);
    for (std::size_t n = 0; n < size_[0]; ++n) sum[n] = v_.set(n, &pair_sum[n * size_[1]]);
    flux_ = u_.set(0, sum.data()) * field.rig().cell_volume();
}

CellTable::Draw CellTable::draw(const std::array<float, 4>& u) const {
    const auto n = u_.draw(0, u[0]);
    std::size_t row = static_cast<std::size_t>(n.item);
    const auto o = v_.draw(row, u[1]);
    row = row * size_[1] + static_cast<std::size_t>(o.item);
    const auto p = s_.draw(row, u[2]);
    row = row * size_[2] + static_cast<std::size_t>(p.item);
    const auto q = t_.draw(row, u[3]);
    row = row * size_[3] + static_cast<std::size_t>(q.item);
    return {{n.item, o.item, p.item, q.item},
            static_cast<CellId>(row),
            double{n.probability} * double{o.probability} * double{p.probability} * double{q.probability},
            {n.remainder, o.remainder, p.remainder, q.remainder}};
}

void CellTable::draw(Block& block, std::size_t size) const {
    assert(size <= Block::kSize);
    Block::Column<std::size_t> row;
    std::array<Block::Column<float>, 4> before, upto;
    const auto find = [&](std::size_t axis, const ConditionalTables& table, std::size_t at, std::size_t i) {
        const ConditionalTables::Step step = table.find(at, block.u[axis][i]);
        before[axis][i] = step.before;
        upto[axis][i] = step.upto;
        return step.item;
    };
    // Each loop prefetches what the next one reads.
    for (std::size_t i = 0; i < size; ++i) {
        block.n[i] = find(0, u_, 0, i);
        const auto n = static_cast<std::size_t>(block.n[i]);
        block.o[i] = find(1, v_, n, i);
        row[i] = n * size_[1] + static_cast<std::size_t>(block.o[i]);
        s_.fetch_guide(row[i], block.u[2][i]);
    }
    for (std::size_t i = 0; i < size; ++i) s_.fetch_sums(row[i], block.u[2][i]);
    for (std::size_t i = 0; i < size; ++i) {
        block.p[i] = find(2, s_, row[i], i);
        row[i] = row[i] * size_[2] + static_cast<std::size_t>(block.p[i]);
        t_.fetch_guide(row[i], block.u[3][i]);
    }
    for (std::size_t i = 0; i < size; ++i) t_.fetch_sums(row[i], block.u[3][i]);
    for (std::size_t i = 0; i < size; ++i) {
        block.q[i] = find(3, t_, row[i], i);
        block.id[i] = static_cast<CellId>(row[i] * size_[3] + static_cast<std::size_t>(block.q[i]));
    }
    for (std::size_t axis = 0; axis < 4; ++axis) {
        for (std::size_t i = 0; i < size; ++i) {
            const auto draw =
                ConditionalTables::finish({0, before[axis][i], upto[axis][i]}, block.u[axis][i]);
            block.link[axis][i] = draw.probability;
            block.remainder[axis][i] = draw.remainder;
        }
    }
}

CellTable::IntervalDraw CellTable::draw_interval(const V2f& u) const {
    const auto n = u_.draw(0, u.x);
    const auto o = v_.draw(static_cast<std::size_t>(n.item), u.y);
    return {n.item, o.item, n.probability * o.probability, {n.remainder, o.remainder}};
}

double CellTable::probability(const Cell& c) const {
    std::size_t row = static_cast<std::size_t>(c.n);
    double p = double{u_.probability(0, c.n)} * double{v_.probability(row, c.o)};
    row = row * size_[1] + static_cast<std::size_t>(c.o);
    p *= double{s_.probability(row, c.p)};
    row = row * size_[2] + static_cast<std::size_t>(c.p);
    return p * double{t_.probability(row, c.q)};
}

void CellTable::probabilities(int n, int o, std::span<float> out) const {
    const std::size_t row = static_cast<std::size_t>(n) * size_[1] + static_cast<std::size_t>(o);
    const float interval = interval_probability(n, o);
    for (std::size_t p = 0; p < size_[2]; ++p) {
        const float column = interval * s_.probability(row, static_cast<int>(p));
        for (std::size_t q = 0; q < size_[3]; ++q) {
            out[p * size_[3] + q] = column * t_.probability(row * size_[2] + p, static_cast<int>(q));
        }
    }
}

std::optional<Cell> CellTable::cell(CellId id) const {
    if (id >= cells()) return std::nullopt;
    std::size_t rest = id;
    Cell c;
    c.q = static_cast<int>(rest % size_[3]), rest /= size_[3];
    c.p = static_cast<int>(rest % size_[2]), rest /= size_[2];
    c.o = static_cast<int>(rest % size_[1]);
    c.n = static_cast<int>(rest / size_[1]);
    return c;
}

}  // namespace lucerna
