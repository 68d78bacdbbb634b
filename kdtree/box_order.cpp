#include "kdtree/box_tree.h"
#include "kdtree/node_order.h"

namespace lucerna {

std::vector<std::uint32_t> box_order(std::span<const V3f> points, const Workers& workers) {
    check_node_order_size(points.size());
    std::vector<OrderEntry<3>> entries(points.size());
    constexpr std::int64_t kGrain = 1 << 14;
    parallel_ranges(
        workers, static_cast<std::int64_t>(points.size()), kGrain,
        [&](std::int64_t begin, std::int64_t end, std::int64_t) {
            for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
                entries[i] = {{points[i].x, points[i].y, points[i].z}, static_cast<std::uint32_t>(i)};
            }
        });
    return node_order<3>(std::move(entries), workers);
}

}  // namespace lucerna
