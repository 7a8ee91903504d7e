// The one derived fact about a specification: the order of printed variables.

#include "core/specification.hpp"

namespace slugs {

std::vector<std::uint32_t> Specification::print_order() const {
  std::vector<std::uint32_t> order;
  order.reserve(variables.size());
  for (const Owner owner : {Owner::Input, Owner::Output})
    for (std::uint32_t i = 0; i < variables.size(); ++i)
      if (variables[i].owner == owner)
        order.push_back(i);
  return order;
}

} // namespace slugs
