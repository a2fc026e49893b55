// SPDX-License-Identifier: MIT
#include "monitor/service/discover_sources.hpp"

#include <algorithm>
#include <set>
#include <tuple>

namespace resonid::monitor {
namespace {

/// A topic with a wildcard at one of its levels.
struct TopicPattern {
  std::string filter;
  std::string level;  ///< What stands in place of the wildcard.
};

std::vector<TopicPattern> patterns_of(const std::string& topic, TopicSyntax syntax) {
  std::vector<TopicPattern> all;
  for (std::size_t begin = 0; begin <= topic.size();) {
    const std::size_t end = std::min(topic.find(syntax.separator, begin), topic.size());
    if (end > begin)
      all.push_back(
          {topic.substr(0, begin) + syntax.wildcard + topic.substr(end), topic.substr(begin, end - begin)});
    begin = end + 1;
  }
  return all;
}

/// What makes two topics those of one source.
using SourceKey = std::tuple<std::string, SampleFormat, std::vector<std::string>>;

SourceKey key_of(const Discovered& d) {
  return {d.stream, *d.format, d.named ? std::vector<std::string>{} : d.columns};
}

class SourceProposer {
 public:
  SourceProposer(std::span<const Discovered> found, const SourceConfig& where)
      : found_(found),
        where_(where),
        syntax_(where.kind == SourceKind::nats ? kNatsSubjects : kMqttTopics),
        topics_(where.kind == SourceKind::nats || where.kind == SourceKind::mqtt) {}

  DiscoveredSources propose() {
    std::set<std::string> kept;  // subjects that a stream has
    for (const auto& d : found_)
      if (!d.stream.empty()) kept.insert(d.name);
    for (const auto& d : found_)
      if (d.format && (!d.stream.empty() || !kept.contains(d.name))) left_.push_back(&d);
    if (topics_) group();
    std::map<std::pair<SourceKey, std::string>, std::string> names;  // of sources
    for (const auto* d : left_) {
      auto& name = names[{key_of(*d), d->name}];
      if (name.empty()) name = add_source(*d, d->name);
      add_axis(*d, name, !d->axis.empty() ? d->axis : d->name);
    }
    return std::move(all_);
  }

 private:
  using Member = std::pair<const Discovered*, std::string>;  // and its level
  using Groups = std::map<std::pair<SourceKey, std::string>, std::vector<Member>>;

  /// The largest first; what two share goes to one.
  void group() {
    Groups groups;
    for (const auto* d : left_)
      for (auto& pattern : patterns_of(d->name, syntax_))
        groups[{key_of(*d), std::move(pattern.filter)}].emplace_back(d, std::move(pattern.level));
    std::vector<Groups::iterator> order;
    for (auto group = groups.begin(); group != groups.end(); ++group) order.push_back(group);
    std::stable_sort(order.begin(), order.end(),
                     [](auto a, auto b) { return a->second.size() > b->second.size(); });
    std::set<const Discovered*> done;
    for (const auto& group : order) {
      auto& members = group->second;
      std::erase_if(members, [&](const Member& m) { return done.contains(m.first); });
      const bool same_level = std::all_of(members.begin(), members.end(),
                                          [&](const Member& m) { return m.second == members[0].second; });
      if (members.empty() || same_level) continue;
      const std::string name = add_source(*members[0].first, group->first.second);
      for (const auto& [d, level] : members) {
        done.insert(d);
        add_axis(*d, name, d->axis.empty() ? level : level + syntax_.separator + d->axis);
      }
    }
    std::erase_if(left_, [&](const Discovered* d) { return done.contains(d); });
  }

  std::string add_source(const Discovered& d, const std::string& filter) {
    SourceConfig source = where_;
    source.format = *d.format;
    if (!d.named) source.columns = d.columns;
    if (source.kind == SourceKind::mqtt) source.topic = filter;
    if (source.kind == SourceKind::nats) {
      source.subject = filter;
      source.stream = d.stream;
    }
    std::string name(name_of(source.kind));
    if (!all_.sources.empty()) name += "-" + std::to_string(all_.sources.size() + 1);
    all_.sources.emplace(name, std::move(source));
    return name;
  }

  void add_axis(const Discovered& d, const std::string& source, const std::string& axis) {
    all_.streams.push_back({source, axis, d.columns, d.rate_hz(), d.samples, d.timed, d.measured_rate_hz});
  }

  std::span<const Discovered> found_;
  const SourceConfig& where_;
  TopicSyntax syntax_;
  bool topics_;
  std::vector<const Discovered*> left_;
  DiscoveredSources all_;
};

}  // namespace

DiscoveredSources sources_of(std::span<const Discovered> found, const SourceConfig& where) {
  return SourceProposer(found, where).propose();
}

}  // namespace resonid::monitor
