// Model checking of explicit strategies and counterstrategies: the certificate
// of a verdict.
//
// Shares with the solver only the parsed formulas, which are evaluated on
// states; there are no decision diagrams here and no fixpoints of the game.  A
// strategy is correct if every play that it allows is legal and won:
//   - every input that ENV_INIT allows has an initial node whose state
//     satisfies SYS_INIT (robotics semantics: every state that both allow is a
//     node);
//   - a node has exactly one successor for each next input that ENV_TRANS
//     allows, none for others, and every edge satisfies SYS_TRANS;
//   - no cycle meets all assumptions infinitely often and starves a guarantee:
//     for each guarantee, no strongly connected component of the edges that do
//     not meet it has an edge for every assumption.
// A counterstrategy is correct in the dual sense:
//   - for some input that ENV_INIT allows, every output that SYS_INIT allows
//     has an initial node (robotics semantics: some initial node exists);
//   - the successors of a node share one next input, allowed by ENV_TRANS, and
//     are exactly the outputs that SYS_TRANS allows then; a node without
//     successors has an allowed next input after which there is no output;
//   - no component of the whole graph meets all guarantees, and no cycle
//     starves an assumption.
// Every node must be reachable from an initial one, so that all of the file is
// part of the certificate.

#pragma once

#include "certificate/graph/strategy_reader.hpp"
#include "core/budget.hpp"
#include "core/specification.hpp"

#include <string>

namespace slugs {

enum class CertificateKind { Strategy, Counterstrategy };

struct CheckResult {
  bool accepted;
  std::string reason; // of a rejection: node, error, constraint
};

// Throws LimitReached.
CheckResult check(const Specification &specification, const ExplicitStrategy &strategy, CertificateKind kind,
                  bool robotics_init, const Budget &budget);

} // namespace slugs
