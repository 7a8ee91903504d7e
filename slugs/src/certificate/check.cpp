// See certificate/check.hpp.

#include "certificate/check.hpp"

#include "certificate/counterstrategy.hpp"
#include "certificate/strategy.hpp"

namespace slugs {

CheckResult check(const Specification &specification, const ExplicitStrategy &strategy, CertificateKind kind,
                  bool robotics_init, const Budget &budget) {
  try {
    CheckModel model(specification, strategy, budget);
    if (kind == CertificateKind::Strategy)
      check_strategy(model, robotics_init);
    else
      check_counterstrategy(model, robotics_init);
  } catch (const Rejection &rejection) {
    return {false, rejection.what()};
  }
  return {true, ""};
}

} // namespace slugs
