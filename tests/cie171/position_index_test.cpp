// CIE 117:1995: compares Guth's position index by its fit with the standard's own table, and the resulting
// ratings.
#include <fmt/format.h>

#include "engine/photometry/glare.h"
#include "engine/photometry/position_table.h"
#include "tests/cie171/case.h"

namespace lucerna::cie171 {
namespace position_index_test {

// Every fifth row of CIE 117:1995, Table 4.1, as transcribed by [eulumdat-ugr 2026]: for a luminaire H above
// the eye, T beside the line of sight, R along it. The columns are H/R = 0, 0.1 ... 1.9; 0 where the table is
// empty.
struct TableRow {
    double t_over_r;
    std::vector<double> index;
};
const std::vector<TableRow> kTable = {
    {0.0, {1.00, 1.26, 1.53, 1.90,  2.35,  2.86,  3.50,  4.20,  5.00, 6.00,
           7.00, 8.10, 9.25, 10.35, 11.70, 13.15, 14.70, 16.20, 0,    0}},
    {0.5, {1.43, 1.60, 1.82, 2.10, 2.48,  2.91,  3.40,  3.98,  4.70,  5.50,
           6.40, 7.30, 8.30, 9.40, 10.50, 11.75, 13.00, 14.40, 15.70, 0}},
    {1.0, {2.11, 2.40, 2.75, 3.10, 3.50,  3.91,  4.40,  5.00,  5.60,  6.20,
           7.00, 7.90, 8.80, 9.75, 10.80, 11.90, 12.95, 14.00, 15.00, 16.00}},
    {1.5, {2.85, 3.15, 3.65, 4.10,  4.55,  5.00,  5.50,  6.20,  6.80,  7.50,
           8.20, 8.85, 9.70, 10.55, 11.50, 12.50, 13.30, 14.05, 15.02, 16.00}},
    {2.0, {3.50, 4.00, 4.50,  4.90,  5.35,  5.80,  6.40,  7.10,  7.70,  8.30,
           8.90, 9.60, 10.40, 11.10, 12.00, 12.85, 13.60, 14.30, 15.10, 16.00}},
    {2.5, {4.00, 4.50,  4.96,  5.40,  5.85,  6.40,  6.95,  7.55,  8.25,  8.85,
           9.50, 10.05, 10.85, 11.55, 12.30, 13.00, 13.80, 14.50, 15.25, 16.00}},
    {3.0, {4.22, 4.67,  5.20,  5.65,  6.12,  6.60,  7.15,  7.80,  8.55,  9.12,
           9.70, 10.23, 10.95, 11.65, 12.35, 13.00, 13.80, 14.50, 15.25, 16.00}}};

double fitted(double t, double h) {
    const Observer observer{"", {}, {0, 1, 0}, {0, 0, 1}};
    return position_index(observer, V3f(V3d(t, 1, h).normalized()));
}

TEST(Cie117, PositionIndex_IsTheTables) {
    double worst = 0, squares = 0;
    int count = 0;
    for (const TableRow& row : kTable) {
        for (std::size_t i = 0; i < row.index.size(); ++i) {
            if (row.index[i] == 0) continue;
            const double h = 0.1 * static_cast<double>(i);
            const double off = fitted(row.t_over_r, h) / row.index[i] - 1;
            worst = std::max(worst, std::fabs(off));
            squares += off * off;
            ++count;
            EXPECT_LE(std::fabs(off), 0.11) << "T/R " << row.t_over_r << ", H/R " << h << ": "
                                            << fitted(row.t_over_r, h) << ", not " << row.index[i];
        }
    }
    RecordProperty("worst", fmt::format("{:.3f}", worst));
    std::puts(fmt::format("position index: {} entries, RMS {:.2f} %, worst {:.2f} %", count,
                          100 * std::sqrt(squares / count), 100 * worst)
                  .c_str());
}

// The table that UGR tables are computed by must have these rows. All of its entries are compared with the
// fit, too, within the fit's own error.
TEST(Cie117, PositionTable_IsTheStandards) {
    for (const TableRow& row : kTable) {
        for (std::size_t i = 0; i < row.index.size(); ++i) {
            const auto index = tabulated_position_index(row.t_over_r, static_cast<double>(i) / 10);
            EXPECT_NEAR(index.value_or(0), row.index[i], 1e-9) << "T/R " << row.t_over_r << ", column " << i;
        }
    }
    for (int t = 0; t <= 30; ++t) {
        for (int h = 0; h <= 19; ++h) {
            const auto index = tabulated_position_index(t / 10.0, h / 10.0);
            const double fit = fitted(t / 10.0, h / 10.0);
            EXPECT_NEAR(fit / index.value_or(fit), 1, 0.11) << "T/R " << 0.1 * t << ", H/R " << 0.1 * h;
        }
    }
}

// For a grid of luminaires above an observer, each adding L²w/p², the ratings by the fit and by the table
// must differ by less than the bound asserted here.
TEST(Cie117, Rating_ByTheFitAndByTheTable) {
    double by_fit = 0, by_table = 0;
    for (const TableRow& row : kTable) {
        for (std::size_t i = 1; i < row.index.size(); ++i) {
            if (row.index[i] == 0) continue;
            // The luminaires are 2 m above the eye, horizontal, 0.36 m², Lambertian.
            const double r = 2 / (0.1 * static_cast<double>(i)), t = row.t_over_r * r;
            const double d2 = r * r + t * t + 4;
            const double solid_angle = 0.36 * 2 / std::pow(d2, 1.5);
            by_fit += 3000.0 * 3000 * solid_angle / std::pow(fitted(row.t_over_r, 2 / r), 2);
            by_table += 3000.0 * 3000 * solid_angle / std::pow(row.index[i], 2);
        }
    }
    const double difference = 8 * std::log10(by_fit / by_table);
    std::puts(fmt::format("UGR by the fit less UGR by the table: {:+.3f}", difference).c_str());
    EXPECT_LE(std::fabs(difference), 0.1);
}

}  // namespace position_index_test
}  // namespace lucerna::cie171
