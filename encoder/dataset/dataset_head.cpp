// DatasetInfo -> Head and Directions.
#include "encoder/dataset/dataset_head.h"

#include <fmt/format.h>

#include <algorithm>

#include "format/limits.h"

namespace btfc {

void describe_tile(const DatasetInfo& info, Head& head) {
  head.width = info.width;
  head.height = info.height;
  head.views = static_cast<std::uint32_t>(info.views.size());
  head.lights = static_cast<std::uint32_t>(info.lights.size());
  head.pairs = static_cast<std::uint32_t>(info.pairs.size());
  head.wrap_u = head.wrap_v = info.wraps ? Wrap::repeat : Wrap::clamp;
}

Directions directions_of(const DatasetInfo& info) {
  Directions d;
  const auto points = [](const std::vector<Direction>& from) {
    std::vector<DirectionPoint> to;
    for (const Direction& direction : from) to.push_back(point_of(direction.theta, direction.phi));
    return to;
  };
  d.views = points(info.views);
  d.lights = points(info.lights);
  for (const DirectionPair& pair : info.pairs) {
    d.pairs.push_back({static_cast<std::uint16_t>(pair.view), static_cast<std::uint16_t>(pair.light)});
  }
  return d;
}

Result<DatasetHead> dataset_head(const DatasetInfo& info, ModelId model) {
  if (info.channel_count() > kMaxChannels) {
    return bad_data(
        fmt::format("the data set has {} channels, expected at most {}", info.channel_count(), kMaxChannels));
  }
  DatasetHead result;
  Head& head = result.head;
  head.model = model;
  describe_tile(info, head);
  head.quantity = info.quantity;
  for (std::uint32_t first = 0; first < info.channel_count(); first += 4) {
    Map map;
    if (info.channel_count() > 4) map.name = fmt::format("image{}", first / 4);
    map.channels = std::min(4u, info.channel_count() - first);
    map.type = info.type;
    map.colour_space = info.colour_space;
    head.maps.push_back(map);
  }
  if (const auto checked = check_direction_counts(head); !checked) {
    Error error = checked.error();
    error.rule = "";
    return error;
  }
  result.directions = directions_of(info);
  return result;
}

}  // namespace btfc
