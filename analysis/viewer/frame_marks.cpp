#include "analysis/viewer/frame_marks.hpp"

#include <algorithm>

#include "physics/measures/measures.hpp"
#include "physics/step/contact_loads.hpp"

namespace soda::analysis {
namespace {

using physics::Vec3;

constexpr std::size_t kMostBytes = 6'000'000, kContactBytes = 40, kGhostBytes = 6;
constexpr std::size_t kMostContacts = 40'000;  // of a frame
constexpr std::size_t kSearchedFrames = 400;   // searching takes time, too

std::array<float, 3> three_floats(const Vec3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

std::size_t bytes_of(const FrameMarks::Frame& frame) {
  return frame.contacts.size() * kContactBytes + frame.ghosts.size() * kGhostBytes;
}

// Only those that bear most; true if that leaves some out.
bool keep_strongest(std::vector<FrameMarks::Contact>& contacts) {
  if (contacts.size() <= kMostContacts) return false;
  std::ranges::stable_sort(contacts, std::ranges::greater(), &FrameMarks::Contact::normal_newton);
  contacts.resize(kMostContacts);
  return true;
}

FrameMarks::Joint shown_joint(const physics::Joint& joint) {
  FrameMarks::Joint shown;
  shown.a = physics::index_of(joint.a);
  shown.b = physics::index_of(joint.b);
  shown.kind = static_cast<std::uint8_t>(joint.kind);
  shown.anchor_a_m = three_floats(joint.anchor_a_m);
  shown.anchor_b_m = three_floats(joint.anchor_b_m);
  shown.label = joint.label;
  return shown;
}

}  // namespace

FrameMarker::FrameMarker(const physics::SceneDescription& scene, std::size_t frames)
    : scene_(scene), geometry_(scene) {
  marks_.every = static_cast<std::uint32_t>((frames + kSearchedFrames - 1) / kSearchedFrames);
  marks_.every = std::max(1u, marks_.every);
  for (const physics::Joint& joint : scene.joints) {
    marks_.joints.push_back(shown_joint(joint));
    unbroken_ += physics::can_break(joint);
  }
}

void FrameMarker::add(const LoggedStep& logged, const models::TerritoryMap& map) {
  const physics::Mechanics mechanics = physics::measure(scene_, logged.ids, logged.states);
  marks_.energies.push_back({static_cast<float>(mechanics.kinetic_energy_joule),
                             static_cast<float>(mechanics.potential_energy_joule)});
  if (unbroken_ > 0) add_broken(logged);
  if (next_ % marks_.every == 0) {
    FrameMarks::Frame frame = marked(logged, map);
    if (bytes_ + bytes_of(frame) > kMostBytes) thin_out();
    if (next_ % marks_.every == 0) {
      bytes_ += bytes_of(frame);
      marks_.frames.push_back(std::move(frame));
    }
  }
  ++next_;
}

FrameMarks::Frame FrameMarker::marked(const LoggedStep& logged, const models::TerritoryMap& map) {
  FrameMarks::Frame frame;
  frame.frame = next_;
  for (const physics::ContactLoad& load :
       physics::contact_loads(scene_, geometry_, logged.ids, logged.states)) {
    if (!load.point) continue;
    const Vec3 force = load.normal * load.normal_newton + load.friction_newton;
    frame.contacts.push_back({physics::index_of(load.a), physics::index_of(load.b),
                              three_floats(load.point->position_m), three_floats(force),
                              static_cast<float>(load.normal_newton),
                              static_cast<float>(-load.point->separation_m)});
  }
  marks_.has_strongest_only |= keep_strongest(frame.contacts);
  std::vector<models::WorldId> owners;
  for (std::size_t i = 0; map.worlds() > 1 && i < logged.ids.size(); ++i) {
    const physics::BodyId id = logged.ids[i];
    map.owners_of(physics::swept_aabb(scene_, geometry_, id, logged.states[i]), owners);
    const models::WorldId own = map.owner_at(logged.states[i].position_m);
    for (const models::WorldId owner : owners)
      if (owner != own)
        frame.ghosts.push_back(
            {physics::index_of(id), static_cast<std::uint16_t>(models::index_of(owner))});
  }
  return frame;
}

void FrameMarker::add_broken(const LoggedStep& logged) {
  for (std::size_t i = 0; i < marks_.joints.size(); ++i) {
    FrameMarks::Joint& joint = marks_.joints[i];
    if (joint.broken_from <= next_ || !physics::can_break(scene_.joints[i])) continue;
    const auto at = std::ranges::lower_bound(logged.ids, scene_.joints[i].a);
    if (at == logged.ids.end() || *at != scene_.joints[i].a) continue;
    if (!physics::is_broken(scene_.joints[i], logged.states[at - logged.ids.begin()])) continue;
    joint.broken_from = next_;
    --unbroken_;
  }
}

// Every second of the frames stays.
void FrameMarker::thin_out() {
  marks_.every *= 2;
  std::erase_if(marks_.frames,
                [this](const FrameMarks::Frame& frame) { return frame.frame % marks_.every != 0; });
  bytes_ = 0;
  for (const FrameMarks::Frame& frame : marks_.frames) bytes_ += bytes_of(frame);
}

}  // namespace soda::analysis
