(** The theorems about files: the bytes of a specification, the graph of a strategy and the claims
    about it. Each function that the program calls is here, with the consequence of its result
    [true]. *)
From Coq Require Import List NArith.
From Proved Require Import Gr1 Simplify Strategy Alive Counterstrategy Parse World Team Views.
Import ListNotations.

(** A text and a strategy that realizes it. *)
Record established := { meaning : spec; names : list text; strategy_graph : graph }.

Definition establish (s : text) (g : graph) : option established :=
  match parse s with
  | Some (sp, ns) => if check sp g then Some {| meaning := sp; names := ns; strategy_graph := g |} else None
  | None => None
  end.

Lemma establish_ok s g e : establish s g = Some e ->
  parse s = Some (meaning e, names e) /\ strategy_graph e = g /\ check (meaning e) g = true.
Proof.
  unfold establish. destruct (parse s) as [(sp, ns) |]; [| discriminate].
  destruct (check sp g) eqn:C; [| discriminate]. intros E. injection E as <-. auto.
Qed.

Theorem establish_sound s g e : establish s g = Some e ->
  exists sp ns, parse s = Some (sp, ns) /\ realizes sp (strategy_of sp g).
Proof.
  intros E. apply establish_ok in E as (P & _ & C). exists (meaning e), (names e).
  split; auto. apply check_realizes; auto.
Qed.

(** It does so in a play in which the assumptions are kept forever and met infinitely often. *)
Definition is_alive (e : established) : bool := alive (meaning e) (strategy_graph e).

Theorem alive_sound s g e : establish s g = Some e -> is_alive e = true ->
  exists sp ns i, parse s = Some (sp, ns) /\
  (forall k x, x < inputs sp -> within sp (i k) x) /\
  let b := play sp (strategy_of sp g) i in
  (forall k, env_ok sp b k /\ sys_ok sp b k) /\
  (forall f, In f (env_live sp) \/ In f (sys_live sp) -> again b f).
Proof.
  intros E A. apply establish_ok in E as (P & G & C). unfold is_alive in A. rewrite G in A.
  destruct (play_exists _ _ C A) as (i & W & K & L). exists (meaning e), (names e), i.
  destruct (check_realizes _ _ C i W) as (S & R). split; [auto | split; [auto | split]].
  - intros k. split; [apply K | apply S, K].
  - intros f [I | I]; auto.
Qed.

(** There is no strategy. *)
Definition refute (s : text) (g : cgraph) (start : list N) : bool :=
  match parse s with Some (sp, _) => check_counter sp g start | None => false end.

Theorem refute_sound s g start : refute s g start = true ->
  exists sp ns, parse s = Some (sp, ns) /\ ~ realizable sp.
Proof.
  unfold refute. destruct (parse s) as [(sp, ns) |]; [| discriminate].
  intros C. exists sp, ns. split; auto. eapply check_counter_sound; eauto.
Qed.

(** The strategy moves as the world and its circumstances allow, and visits its targets. *)
Definition moves (e : established) (w : world) (c : circumstances) (targets : list (list N)) : bool :=
  match places_of (names e) c with
  | Some p => if keeps w c p (strategy_graph e)
              then visits (meaning e) p (strategy_graph e) targets else false
  | None => false
  end.

Theorem moves_sound s g e w c targets : establish s g = Some e -> moves e w c targets = true ->
  exists sp ns p, parse s = Some (sp, ns) /\ places_of ns c = Some p /\
  forall i, (forall k x, x < inputs sp -> within sp (i k) x) ->
  let b := play sp (strategy_of sp g) i in
  (forall k, env_ok sp b k ->
     good_place w c (b k (region p)) = true /\
     forall j, j < k -> good_step w c p (b j) (b (S j)) = true) /\
  ((forall k, env_ok sp b k) -> (forall a, In a (env_live sp) -> again b a) ->
   forall t, In t targets -> forall k, exists j, k <= j /\ In (b j (region p)) t).
Proof.
  intros E. apply establish_ok in E as (P & <- & C). unfold moves.
  destruct (places_of (names e) c) as [p |] eqn:Q; [| discriminate].
  destruct (keeps w c p (strategy_graph e)) eqn:K; [| discriminate].
  intros V. exists (meaning e), (names e), p. split; [auto | split; [auto |]].
  intros i W. split; [apply keeps_sound; auto | apply visits_sound; auto].
Qed.

(** A strategy in a team: its robot, its task, and the number of other robots. *)
Definition controller_of (m : established * nat * circumstances * nat) : option controller :=
  let '(e, q, c, n) := m in
  match places_of (names e) c with
  | Some p => Some {| robot := q; about := c; crowd := n; vars := p;
                      signals := inputs (meaning e); nodes := strategy_graph e |}
  | None => None
  end.

Fixpoint controllers_of (ms : list (established * nat * circumstances * nat)) : option (list controller) :=
  match ms with
  | [] => Some []
  | m :: ms => match controller_of m, controllers_of ms with
               | Some c, Some cs => Some (c :: cs)
               | _, _ => None
               end
  end.

(** Strategies that each keep the rules of movement keep the team apart. *)
Definition apart (w : world) (pairs : list (nat * nat)) (starts : list N)
    (ms : list (established * nat * circumstances * nat)) : bool :=
  match controllers_of ms with Some cs => check_team w pairs starts cs | None => false end.

Theorem team_sound w pairs starts ms : apart w pairs starts ms = true ->
  exists team, controllers_of ms = Some team /\ forall s, reached w pairs starts team s ->
  (forall q r x, conflict pairs q r = true -> q <> r -> In x (holds s q) -> In x (holds s r) -> False) /\
  (forall q x, In x (holds s q) -> free w x = true /\ ~ shut s q x).
Proof.
  unfold apart. destruct (controllers_of ms) as [cs |]; [| discriminate].
  intros C. exists cs. split; auto. intros s R. split.
  - intros q r x. exact (never_meet w pairs starts cs C s q r x R).
  - intros q x. exact (never_in_an_obstacle w pairs starts cs C s q x R).
Qed.

(** And each has a successor for every possible observation of the others. *)
Definition answering (w : world) (pairs : list (nat * nat)) (starts : list N)
    (ms : list (established * nat * circumstances * nat)) : bool :=
  match controllers_of ms with Some cs => forallb (check_views w) cs | None => false end.

Theorem answers_sound w pairs starts ms :
  apart w pairs starts ms = true -> answering w pairs starts ms = true ->
  exists team, controllers_of ms = Some team /\ forall s, reached w pairs starts team s ->
  forall q c u others, post s q = Some (c, u) -> length others <= crowd c ->
  exists v, edge (nodes c) u v /\ shows (vars c) v (seen w s others (at_ c u)) = true.
Proof.
  unfold apart, answering. destruct (controllers_of ms) as [cs |]; [| discriminate].
  intros C V. exists cs. split; auto. intros s R q c u others P L. rewrite forallb_forall in V.
  apply (never_stuck w pairs starts cs C s q c u others R); auto. apply V.
  apply (proj2 (proj2 (proj2 (reached_in_order w pairs starts cs C s R))) q c u P).
Qed.
