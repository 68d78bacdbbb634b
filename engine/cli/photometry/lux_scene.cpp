#include "engine/cli/photometry/lux_scene.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "engine/cli/photometry/plan_files.h"
#include "engine/cli/render/checkpointing.h"
#include "engine/photometry/daylight_glare.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

// Returns the middles of the walls, in the order of their surfaces.
std::vector<std::pair<V3d, std::string>> walls_of(const std::vector<Room>& rooms) {
    std::vector<std::pair<V3d, std::string>> walls;
    for (const Room& room : rooms) {
        for (std::size_t i = 0; i < room.walls().size(); ++i) {
            const Wall& wall = room.walls()[i];
            walls.emplace_back((wall.from + wall.to) / 2, fmt::format("wall {}", i + 1));
        }
    }
    return walls;
}

// Tells whether a luminaire hangs in the room, whose own shape may hide its middle.
bool is_in(const Room& room, const LuminairePlace& lamp, const Scene& scene) {
    constexpr double kAboveCeiling = 0.5, kBeside = 0.1;  // m
    const int up = room.up_axis();
    if (!(lamp.place[up] > room.floor() && lamp.place[up] < room.ceiling() + kAboveCeiling)) return false;
    if (room.holds(scene, lamp.place)) return true;
    for (const int axis : {(up + 1) % 3, (up + 2) % 3}) {
        for (const double side : {-1.0, 1.0}) {
            V3d beside = lamp.place;
            beside[axis] += side * (lamp.size[axis] / 2 + kBeside);
            if (room.holds(scene, beside)) return true;
        }
    }
    return false;
}

// Keeps the luminaires that are in a room, the first that holds them; returns the index of the room of each.
std::vector<std::size_t> keep_those_in(std::span<const Room> rooms, const Scene& scene,
                                       std::vector<LuminairePlace>& lamps) {
    std::vector<std::size_t> room_of;
    std::vector<LuminairePlace> kept;
    for (LuminairePlace& lamp : lamps) {
        const auto room =
            std::ranges::find_if(rooms, [&](const Room& each) { return is_in(each, lamp, scene); });
        if (room == rooms.end()) continue;
        room_of.push_back(static_cast<std::size_t>(room - rooms.begin()));
        kept.push_back(std::move(lamp));
    }
    lamps = std::move(kept);
    return room_of;
}

// `lamps` are the types of the luminaires in the room.
RoomText room_text(const Room& room, const Scene& scene, std::span<const LuminaireType* const> lamps,
                   std::span<const CalculationSurface> tasks) {
    const V3d size = room.bounds().size();
    const int up = room.up_axis();
    RoomText text{.size = V3d(size[(up + 1) % 3], size[(up + 2) % 3], size[up]),
                  .walls = room.walls().size(),
                  .is_open_sided = room.is_open_sided(),
                  .reflectances = room.reflectances(scene),
                  .area = room.area(scene),
                  .tasks = {}};
    for (std::size_t i = 0; i < tasks.size(); ++i) {
        if (room.holds(scene, tasks[i].corner + (tasks[i].u + tasks[i].v) / 2)) text.tasks.push_back(i);
    }
    text.luminaires = lamps.size();
    const bool is_stated = std::ranges::all_of(lamps, [](const auto* lamp) { return lamp->watts > 0; });
    for (const LuminaireType* const lamp : lamps) text.watts += is_stated ? lamp->watts : 0;
    return text;
}

// Returns the light group of each luminaire; empty if the scene has none.
std::vector<std::string> groups_of(std::span<const LuminairePlace> places, const Scene& scene) {
    const LightGroups& groups = scene.light_groups();
    std::vector<std::string> names;
    for (const LuminairePlace& lamp : places) {
        if (!groups.empty()) names.push_back(groups.names[groups.of_light[lamp.light]]);
    }
    return names;
}

}  // namespace

LuxPage described(const LuxCommand& command, const RoomSurfaces& room, const Job& job, Monitor& monitor) {
    LuxPage page{std::filesystem::path(command.common.scene).stem().string(), {}, {}, command.options.seed};
    page.maintenance = command.maintenance;
    page.up_axis = command.surfaces.up(job);
    page.right_handed = is_right_handed(job);
    if (!command.draws_plans()) return page;
    for (const CalculationSurface& surface : room.surfaces) {
        page.model.push_back(model_lines(job.scene, as_seen(surface, page.up_axis, page.right_handed),
                                         page.up_axis, room.rooms));
    }
    page.luminaires.places = luminaires_of(job.scene);
    std::vector<std::size_t> room_of;  // of each luminaire
    if (!room.rooms.empty()) {
        const std::size_t all = page.luminaires.places.size();
        room_of = keep_those_in(room.rooms, job.scene, page.luminaires.places);
        page.lights_outside = all - room_of.size();
    }
    if (!command.has_page()) return page;
    page.facts = picture_facts(job, command.options.seed);
    page.about = command.about;
    if (std::ranges::none_of(page.about, [](const auto& line) { return lower_case(line.first) == "date"; }))
        page.about.emplace_back("Date", fmt::format("{:%Y-%m-%d}", fmt::localtime(std::time(nullptr))));
    page.tasks = static_cast<std::size_t>(std::ranges::count(room.areas, Area::task));
    page.luminaires =
        with_types(std::move(page.luminaires.places), job.scene, command.options.workers, monitor);
    page.groups = groups_of(page.luminaires.places, job.scene);
    const auto tasks = std::span(room.surfaces).first(page.tasks);
    page.floor = NAN;
    for (std::size_t r = 0; r < room.rooms.size(); ++r) {
        std::vector<const LuminaireType*> lamps;
        for (std::size_t i = 0; i < room_of.size(); ++i) {
            if (room_of[i] == r) lamps.push_back(&page.luminaires.types[page.luminaires.type_of[i]]);
        }
        page.rooms.push_back(room_text(room.rooms[r], job.scene, lamps, tasks));
        page.floor = std::fmin(page.floor, room.rooms[r].floor());
    }
    page.walls = walls_of(room.rooms);
    page.hours = command.hours;
    page.margin = command.surfaces.margin;
    page.has_daylight = has_daylight(job.scene);
    page.task = command.requirements.task;
    return page;
}

}  // namespace lucerna
