// The part of the C interface that says what a file was made for.
#include "decoder/handles.h"

namespace {

using namespace btfc;

btfc_direction_range range_of(const DirectionRange& r) {
  return {r.theta_least, r.theta_most, r.phi_from, r.phi_width};
}

btfc_result write_listed(const DomainSide& side, uint32_t index, float direction[3]) {
  if (direction == nullptr || index >= side.points.size()) return bad(nullptr, "");
  write_direction(side.points, index, direction);
  return BTFC_OK;
}

}  // namespace

uint32_t btfc_covers(const btfc_texture* texture, const float view[3], const float light[3],
                     float footprint) {
  if (texture == nullptr || view == nullptr || light == nullptr) {
    bad(nullptr, "");
    return 0;
  }
  return covered(texture->domain, texture->view_hull, texture->light_hull,
                 surface_direction({view[0], view[1], view[2]}),
                 surface_direction({light[0], light[1], light[2]}), footprint);
}

btfc_result btfc_texture_domain(const btfc_texture* texture, btfc_domain* domain_ret) {
  if (texture == nullptr || domain_ret == nullptr) return bad(nullptr, "");
  const Domain& d = texture->domain;
  *domain_ret = {};
  domain_ret->stated = texture->domain_stated ? 1 : 0;
  domain_ret->views = static_cast<btfc_domain_kind>(d.views.kind);
  domain_ret->lights = static_cast<btfc_domain_kind>(d.lights.kind);
  domain_ret->view_range = range_of(d.views.range);
  domain_ret->light_range = range_of(d.lights.range);
  domain_ret->view_count = static_cast<uint32_t>(d.views.points.size());
  domain_ret->light_count = static_cast<uint32_t>(d.lights.points.size());
  domain_ret->tolerance = d.tolerance;
  domain_ret->radius = d.radius;
  domain_ret->origin_x = d.origin_x;
  domain_ret->origin_y = d.origin_y;
  domain_ret->scale = uint32_t{1} << d.scale_log2;
  domain_ret->footprint_least = d.footprint_least;
  domain_ret->footprint_most = d.footprint_most;
  return BTFC_OK;
}

btfc_result btfc_domain_view(const btfc_texture* texture, uint32_t index, float direction[3]) {
  return texture == nullptr ? bad(nullptr, "") : write_listed(texture->domain.views, index, direction);
}

btfc_result btfc_domain_light(const btfc_texture* texture, uint32_t index, float direction[3]) {
  return texture == nullptr ? bad(nullptr, "") : write_listed(texture->domain.lights, index, direction);
}
