// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>

#include "report/json/passes.hpp"

namespace resonid::report {
namespace {

using nlohmann::json;

class Writer final : public Fields {
 public:
  explicit Writer(json& root) : Fields(Pass::write), at_{&root} { root = json::object(); }

  void schema(std::initializer_list<std::string_view> names) override { here()["schema"] = *names.begin(); }

 protected:
  bool leaf(const Key& key, Presence, Value value, bool there) override {
    if (there) std::visit([&](const auto* v) { put(std::string(key.name), *v); }, value);
    return there;
  }
  bool open(const Key& key, Presence, bool there) override {
    if (there) at_.push_back(&(here()[std::string(key.name)] = json::object()));
    return there;
  }
  void close() override { at_.pop_back(); }
  std::optional<std::size_t> open_list(const Key& key, Presence, std::size_t size, bool there) override {
    if (!there) return std::nullopt;
    at_.push_back(&(here()[std::string(key.name)] = json::array()));
    return size;
  }
  void open_element(std::size_t) override {
    here().push_back(json::object());
    at_.push_back(&here().back());
  }
  void close_element() override { at_.pop_back(); }
  void close_list() override { at_.pop_back(); }

 private:
  [[nodiscard]] json& here() noexcept { return *at_.back(); }

  template <class T>
  void put(const std::string& key, const T& value) {
    here()[key] = value;
  }
  void put(const std::string& key, double value) {
    if (std::isfinite(value)) here()[key] = value;  // JSON has no other numbers
  }
  void put(const std::string& key, const Chosen& value) { here()[key] = value.names[value.index]; }
  void put(const std::string& key, const Eigen::MatrixXd& m) {
    json rows = json::array();
    for (Eigen::Index i = 0; i < m.rows(); ++i) {
      json row = json::array();
      for (Eigen::Index k = 0; k < m.cols(); ++k) row.push_back(m(i, k));
      rows.push_back(std::move(row));
    }
    here()[key] = std::move(rows);
  }
  void put(const std::string& key, const Gaps& rows) {
    json list = json::array();
    for (const double v : rows.value) list.push_back(std::isfinite(v) ? json(v) : json());
    here()[key] = std::move(list);
  }

  std::vector<json*> at_;  // of the objects and lists that are open, all but the last of which stay in place
};

}  // namespace

json write(const std::function<void(Fields&)>& description) {
  json root;
  Writer writer(root);
  description(writer);
  return root;
}

}  // namespace resonid::report
