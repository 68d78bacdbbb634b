#include "engine/photometry/ugr_text.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <vector>

#include "engine/photometry/illuminance_text.h"

namespace lucerna {
namespace {

constexpr std::array<const char*, 2> kViews{"crosswise", "endwise"};

// Returns the ratings with `correction` added to each, a line for each room and both views side by side.
std::string ratings_text(const UgrTable& table, double correction) {
    std::vector<std::vector<std::string>> rows{{"view"}, {"X x Y"}};
    for (const char* view : kViews) {
        for (const UgrReflectances& of : kUgrReflectances) {
            rows[0].emplace_back(view);
            rows[1].push_back(
                fmt::format("{:.0f}/{:.0f}/{:.0f}", 100 * of.ceiling, 100 * of.walls, 100 * of.floor));
        }
    }
    for (std::size_t i = 0; i < kUgrRooms.size(); ++i) {
        auto& row = rows.emplace_back(1, fmt::format("{}H x {}H", kUgrRooms[i].across, kUgrRooms[i].along));
        for (const auto& ratings : table.uncorrected[i]) {
            for (const double rating : ratings)
                row.push_back(std::isfinite(rating) ? fmt::format("{:.1f}", rating + correction) : "none");
        }
    }
    return table_text(rows);
}

}  // namespace

std::string ugr_method(const UgrTable& table) {
    return fmt::format("CIE 190:2010, S/H = {:.4g}", 1.0 / table.per_height);
}

std::string ugr_text(const UgrTable& table) {
    const auto part = [&table](double lumens, double correction, const char* which) {
        return fmt::format("UGR for {:.6g} lm of the lamps{}; {}; reflectances of ceiling/walls/floor in %\n",
                           lumens, which, ugr_method(table)) +
               ratings_text(table, correction) + '\n';
    };
    return part(1000, 0, " (uncorrected)") + part(table.lamp_flux, table.correction(), "");
}

std::string ugr_csv(const UgrTable& table) {
    std::string text =
        "X [H],Y [H],view,ceiling,walls,floor,UGR for 1000 lm,UGR for the lamp flux,lamp flux [lm],method\n";
    for (std::size_t i = 0; i < kUgrRooms.size(); ++i) {
        for (const std::size_t view : {kCrosswise, kEndwise}) {
            for (std::size_t j = 0; j < kUgrReflectances.size(); ++j) {
                const UgrReflectances& of = kUgrReflectances[j];
                const double rating = table.uncorrected[i][view][j];
                text += fmt::format("{},{},{},{:g},{:g},{:g},", kUgrRooms[i].across, kUgrRooms[i].along,
                                    kViews[view], of.ceiling, of.walls, of.floor);
                text += std::isfinite(rating)
                            ? fmt::format("{:.3f},{:.3f}", rating, rating + table.correction())
                            : std::string(",");
                text += fmt::format(",{:.7g},\"{}\"\n", table.lamp_flux, ugr_method(table));
            }
        }
    }
    return text;
}

}  // namespace lucerna
