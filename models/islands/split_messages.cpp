#include "models/islands/split_messages.hpp"

#include <algorithm>
#include <utility>

#include "models/messages/codec.hpp"

namespace soda::models {
namespace {

void write_island(const IslandName& island, Writer& writer) {
  writer.id(island.label);
  for (const std::uint64_t part : island.content) writer.number(part);
}

IslandName read_island(Reader& reader) {
  IslandName island;
  island.label = reader.id();
  for (std::uint64_t& part : island.content) part = reader.number<std::uint64_t>();
  return island;
}

void write_work(const physics::Work& work, Writer& writer) {
  writer.number(work.sum);
  writer.number(work.scale);
}

physics::Work read_work(Reader& reader) {
  physics::Work work;
  work.sum = reader.number<double>();
  work.scale = reader.number<double>();
  return work;
}

void write_driven(const physics::Driven& driven, Writer& writer) {
  writer.number(driven.surface_m_s);
  writer.number(driven.mass_kg);
  writer.number(driven.without_joule);
  writer.number(driven.half_joule);
  writer.number(driven.after_joule);
}

physics::Driven read_driven(Reader& reader) {
  physics::Driven driven;
  driven.surface_m_s = reader.number<double>();
  driven.mass_kg = reader.number<double>();
  driven.without_joule = reader.number<double>();
  driven.half_joule = reader.number<double>();
  driven.after_joule = reader.number<double>();
  return driven;
}

void write_step_work(const physics::StepWork& work, Writer& writer) {
  write_work(work.after, writer);
  write_work(work.without, writer);
  write_work(work.fields, writer);
  write_driven(work.driven, writer);
}

physics::StepWork read_step_work(Reader& reader) {
  physics::StepWork work;
  work.after = read_work(reader);
  work.without = read_work(reader);
  work.fields = read_work(reader);
  work.driven = read_driven(reader);
  return work;
}

void write_report(const physics::BlockReport& report, Writer& writer) {
  writer.number(report.max_penetration_m);
  writer.number(report.constraint_residual_m_s);
  writer.vector(report.static_impulse_newton_s);
  writer.vector(report.static_angular_impulse_newton_m_s);
}

physics::BlockReport read_report(Reader& reader) {
  physics::BlockReport report;
  report.max_penetration_m = reader.number<double>();
  report.constraint_residual_m_s = reader.number<double>();
  report.static_impulse_newton_s = reader.vector();
  report.static_angular_impulse_newton_m_s = reader.vector();
  return report;
}

}  // namespace

IslandName island_named_in(std::span<const std::byte> payload) {
  Reader reader(payload);
  return read_island(reader);
}

kernel::Payload encode_border_news(const BorderNews& news) {
  kernel::Bytes bytes;
  Writer writer(bytes);
  write_island(news.island, writer);
  writer.number(news.border);
  writer.number(static_cast<std::uint32_t>(news.from_before));
  writer.number(static_cast<std::uint32_t>(news.bodies.size()));
  for (const physics::BorderBody& body : news.bodies) {
    writer.vector(body.linear);
    writer.vector(body.angular);
    writer.vector(body.displacement.linear_m);
    writer.vector(body.displacement.angular_rad);
  }
  return kernel::Payload(std::move(bytes));
}

BorderNews decode_border_news(std::span<const std::byte> payload) {
  Reader reader(payload);
  BorderNews news;
  news.island = read_island(reader);
  news.border = reader.number<std::uint32_t>();
  news.from_before = reader.number<std::uint32_t>() != 0;
  news.bodies.resize(reader.number<std::uint32_t>());
  for (physics::BorderBody& body : news.bodies) {
    body.linear = reader.vector();
    body.angular = reader.vector();
    body.displacement.linear_m = reader.vector();
    body.displacement.angular_rad = reader.vector();
  }
  return news;
}

kernel::Payload encode_work_news(const WorkNews& news) {
  kernel::Bytes bytes;
  Writer writer(bytes);
  write_island(news.island, writer);
  writer.number(news.first);
  writer.number(static_cast<std::uint32_t>(news.work.size()));
  for (const physics::StepWork& work : news.work) write_step_work(work, writer);
  return kernel::Payload(std::move(bytes));
}

WorkNews decode_work_news(std::span<const std::byte> payload) {
  Reader reader(payload);
  WorkNews news;
  news.island = read_island(reader);
  news.first = reader.number<std::uint32_t>();
  news.work.resize(reader.number<std::uint32_t>());
  for (physics::StepWork& work : news.work) work = read_step_work(reader);
  return news;
}

kernel::Payload encode_block_news(const BlockNews& news) {
  kernel::Bytes bytes;
  Writer writer(bytes);
  write_island(news.island, writer);
  writer.number(news.first);
  writer.number(news.last);
  writer.number(static_cast<std::uint32_t>(news.bodies.size()));
  for (const BlockNews::Moved& moved : news.bodies) {
    writer.id(moved.id);
    writer.state(moved.state);
  }
  writer.number(static_cast<std::uint32_t>(news.faults.size()));
  for (const physics::AdvanceFault& fault : news.faults) {
    writer.id(fault.body);
    writer.number(static_cast<std::uint32_t>(fault.what.size()));
    for (const char letter : fault.what) writer.number(letter);
  }
  writer.number(static_cast<std::uint32_t>(news.reports.size()));
  for (const physics::BlockReport& report : news.reports) write_report(report, writer);
  return kernel::Payload(std::move(bytes));
}

BlockNews decode_block_news(std::span<const std::byte> payload) {
  Reader reader(payload);
  BlockNews news;
  news.island = read_island(reader);
  news.first = reader.number<std::uint32_t>();
  news.last = reader.number<std::uint32_t>();
  news.bodies.resize(reader.number<std::uint32_t>());
  for (BlockNews::Moved& moved : news.bodies) {
    moved.id = reader.id();
    moved.state = reader.state();
  }
  news.faults.resize(reader.number<std::uint32_t>());
  for (physics::AdvanceFault& fault : news.faults) {
    fault.body = reader.id();
    fault.what.resize(reader.number<std::uint32_t>());
    for (char& letter : fault.what) letter = reader.number<char>();
  }
  news.reports.resize(reader.number<std::uint32_t>());
  for (physics::BlockReport& report : news.reports) report = read_report(reader);
  return news;
}

}  // namespace soda::models
