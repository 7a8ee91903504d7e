(** Robots that share a world. Robots in conflict never occupy one region, and no robot is in an
    unresolved obstacle that blocks it, at rest or in transit. To be read: the definitions up to
    [reached]; [event] contains all assumptions about the program that runs them. *)
From Coq Require Import List NArith PArith Arith Bool Lia FMapPositive.
From Proved Require Import Gr1 Simplify Ranks Strategy Parse World.
Import ListNotations.
Local Open Scope N_scope.

(** A strategy of the bundle: its robot, its task, and the number of other robots in conflict with
    it. *)
Record controller := { robot : nat; about : circumstances; crowd : nat;
  vars : places; signals : nat (** number of inputs *); nodes : graph }.

Definition at_ (c : controller) (u : node) : N := state_of u (region (vars c)).

Section Team.
Variable w : world.
Variable pairs : list (nat * nat).  (** pairs of robots in conflict *)
Variable starts : list N.  (** of each robot *)
Variable team : list controller.

Definition conflict (q r : nat) : bool :=
  existsb (fun p => (Nat.eqb (fst p) q && Nat.eqb (snd p) r)
                 || (Nat.eqb (fst p) r && Nat.eqb (snd p) q)) pairs.

(** A state of the team. [holds]: the regions that a robot occupies; in transit, both ends of its
    step. [post]: its strategy and node, at rest. [shut]: the regions of unresolved obstacles that
    block it. *)
Record moment := { holds : nat -> list N; post : nat -> option (controller * node);
                   shut : nat -> N -> Prop }.

Definition begins (s : moment) : Prop :=
  (forall q, holds s q = match nth_error starts q with Some x => [x] | None => [] end) /\
  (forall q, post s q = None) /\ (forall q x, In x (holds s q) -> ~ shut s q x).

Definition alike (s s' : moment) (q : nat) : Prop :=  (** except for robot [q] *)
  (forall r, r <> q -> holds s' r = holds s r /\ post s' r = post s r) /\
  (forall r x, shut s' r x -> shut s r x).

Definition near (x y : N) : Prop := exists d, beside w d x y = true.

(** Possible events, in any order and with any durations of steps. *)
Inductive event (s s' : moment) : Prop :=
| Departs q c u v :  (** a robot takes the step that its strategy chooses for its observation *)
    post s q = Some (c, u) -> edge (nodes c) u v ->
    (** its observation is true: a robot beside it, or in transit to there, is shown on that side,
        unless its strategy was made with this region closed *)
    (forall r x d y, conflict q r = true -> r <> q -> In x (holds s r) ->
       beside w d (at_ c u) x = true -> In (d, y) (sees (vars c)) ->
       state_of v y <> 0 \/ In x (closed (about c))) ->
    (** an obstacle that its strategy does not know is detected before it is entered *)
    (shut s q (at_ c v) -> In (at_ c v) (closed (about c))) ->
    holds s' q = [at_ c u; at_ c v] -> post s' q = None -> alike s s' q -> event s s'
| Rests q x :  (** a step has ended, at either end; from there it may go by any of its strategies *)
    In x (holds s q) -> holds s' q = [x] ->
    (forall c u, post s' q = Some (c, u) ->
       In c team /\ robot c = q /\ In u (all_of (nodes c)) /\ at_ c u = x) ->
    alike s s' q -> event s s'
| Led q a x :  (** a step of a joint plan: the program checks that the region is free *)
    holds s q = [a] -> near a x -> free w x = true -> ~ shut s q x ->
    (forall r, conflict q r = true -> r <> q -> ~ In x (holds s r)) ->
    holds s' q = [a; x] -> post s' q = None -> alike s s' q -> event s s'
| Changes :  (** obstacles are resolved, disappear, and appear where they block no robot *)
    (forall q x, shut s' q x -> shut s q x \/ ~ In x (holds s q)) ->
    (forall q, holds s' q = holds s q /\ post s' q = post s q) -> event s s'.

Inductive reached : moment -> Prop :=
| Begin s : begins s -> reached s
| Then s s' : reached s -> event s s' -> reached s'.

(** * The check *)

(** A robot in conflict with another one only steps to regions that it observes. *)
Definition looks_out (p : places) (u v : node) : bool :=
  let r := state_of u (region p) in let r' := state_of v (region p) in
  if r =? r' then true else existsb (fun dx => beside w (fst dx) r r') (sees p).

Definition check_controller (c : controller) : bool :=
  if keeps w (about c) (vars c) (nodes c) then
    if existsb (fun p => Nat.eqb (fst p) (robot c) || Nat.eqb (snd p) (robot c)) pairs then
      forallb (fun u => match look (nodes c) (next u) with
        | Some vs => forallb (looks_out (vars c) u) vs
        | None => false
        end) (all_of (nodes c))
    else true
  else false.

Definition check_starts : bool :=
  forallb (free w) starts &&
  forallb (fun p => Nat.eqb (fst p) (snd p) ||
    match nth_error starts (fst p), nth_error starts (snd p) with
    | Some x, Some y => negb (x =? y)
    | _, _ => false
    end) pairs.

Definition check_team : bool := check_starts && forallb check_controller team.

Hypothesis checked : check_team = true.

(** * Soundness *)

Lemma conflict_sym q r : conflict q r = conflict r q.
Proof.
  unfold conflict. induction pairs as [| p ps IH]; [reflexivity |]. cbn. rewrite IH. f_equal.
  apply orb_comm.
Qed.

Definition in_order (s : moment) : Prop :=
  (forall q r x, conflict q r = true -> q <> r -> In x (holds s q) -> ~ In x (holds s r)) /\
  (forall q x, In x (holds s q) -> free w x = true /\ ~ shut s q x) /\
  (forall q x y, In x (holds s q) -> In y (holds s q) -> x = y \/ near x y) /\
  (forall q c u, post s q = Some (c, u) ->
     holds s q = [at_ c u] /\ In c team /\ robot c = q /\ In u (all_of (nodes c))).

Lemma in_order_first s : begins s -> in_order s.
Proof.
  intros (H & P & B). unfold check_team, check_starts in checked.
  rewrite !andb_true_iff, !forallb_forall in checked. destruct checked as ((A & D) & _).
  assert (forall q x, In x (holds s q) -> nth_error starts q = Some x) as E.
  { intros q x I. rewrite H in I. destruct (nth_error starts q); [| destruct I].
    destruct I as [-> | []]; auto. }
  split; [| split; [| split]].
  - intros q r x C N I J. apply E in I, J. unfold conflict in C.
    apply existsb_exists in C as ((a, b) & M & C). specialize (D _ M). cbn in *.
    apply orb_true_iff in C as [C | C]; apply andb_true_iff in C as (C & C');
      apply Nat.eqb_eq in C, C'; subst; rewrite I, J, N.eqb_refl in D; cbn in D;
      rewrite orb_false_r in D; apply Nat.eqb_eq in D; auto.
  - intros q x I. split; [apply A; eapply nth_error_In; eauto | apply B; auto].
  - intros q x y I J. apply E in I, J. left. congruence.
  - intros q c u Q. rewrite P in Q. discriminate.
Qed.

Lemma controller_parts c u : In c team -> In u (all_of (nodes c)) ->
  good_place w (about c) (at_ c u) = true /\
  forall v, edge (nodes c) u v ->
    In v (all_of (nodes c)) /\
    good_step w (about c) (vars c) (state_of u) (state_of v) = true /\
    (forall r, conflict (robot c) r = true -> at_ c u = at_ c v \/
       exists d y, In (d, y) (sees (vars c)) /\ beside w d (at_ c u) (at_ c v) = true).
Proof.
  intros C U. unfold check_team in checked. rewrite andb_true_iff, !forallb_forall in checked.
  destruct checked as (_ & K). specialize (K c C). unfold check_controller in K.
  destruct (keeps w (about c) (vars c) (nodes c)) eqn:E; [| discriminate].
  unfold keeps in E. rewrite forallb_forall in E. specialize (E u U). unfold keeps_node in E.
  apply andb_true_iff in E as (P & E). split; [exact P |]. intros v (vs & L & I).
  rewrite L, forallb_forall in E. split; [| split; [auto |]].
  - clear - L I. revert vs L I. induction (next u) as [| p ps IH]; intros vs L I; cbn in L.
    + injection L as <-. destruct I.
    + destruct (PositiveMap.find p (nodes c)) as [n |] eqn:F; [| discriminate].
      destruct (look (nodes c) ps) as [us |]; [| discriminate]. injection L as <-.
      destruct I as [<- | I]; [| apply (IH us); auto].
      unfold all_of. change n with (snd (p, n)). apply in_map, PositiveMap.elements_correct; auto.
  - intros r Q. destruct (existsb _ pairs) eqn:X.
    + rewrite forallb_forall in K. specialize (K u U). rewrite L, forallb_forall in K.
      specialize (K v I). unfold looks_out in K. unfold at_.
      destruct (N.eqb_spec (state_of u (region (vars c))) (state_of v (region (vars c)))); [auto |].
      right. apply existsb_exists in K as ((d, y) & S & B). exists d, y. auto.
    + exfalso. rewrite <- not_true_iff_false in X. apply X. unfold conflict in Q.
      apply existsb_exists in Q as (p & M & Q). apply existsb_exists. exists p. split; auto.
      apply orb_true_iff in Q as [Q | Q]; apply andb_true_iff in Q as (Q & Q'); rewrite ?Q, ?Q';
        auto using orb_true_r.
Qed.

(** One robot enters a region, and the others keep their regions. *)
Lemma entered s s' q a x : in_order s -> holds s q = [a] -> holds s' q = [a; x] -> post s' q = None ->
  alike s s' q -> a = x \/ near a x -> free w x = true -> ~ shut s q x ->
  (forall r, conflict q r = true -> r <> q -> ~ In x (holds s r)) -> in_order s'.
Proof.
  intros (O1 & O2 & O3 & O4) H H' P (A & S) M F B R.
  assert (forall y, In y (holds s' q) -> y = a \/ y = x) as Y.
  { intros y. rewrite H'. intros [<- | [<- | []]]; auto. }
  assert (In a (holds s q)) as I by (rewrite H; left; auto).
  split; [| split; [| split]].
  - intros p r y C N Ip Ir.
    destruct (Nat.eq_dec p q) as [-> | Dp]; destruct (Nat.eq_dec r q) as [-> | Dr]; [auto | | |].
    + rewrite (proj1 (A r Dr)) in Ir. destruct (Y y Ip) as [-> | ->].
      * exact (O1 q r a C N I Ir).
      * exact (R r C Dr Ir).
    + rewrite (proj1 (A p Dp)) in Ip. rewrite conflict_sym in C. destruct (Y y Ir) as [-> | ->].
      * exact (O1 q p a C (not_eq_sym N) I Ip).
      * exact (R p C Dp Ip).
    + rewrite (proj1 (A p Dp)) in Ip. rewrite (proj1 (A r Dr)) in Ir. exact (O1 p r y C N Ip Ir).
  - intros p y Ip. destruct (Nat.eq_dec p q) as [-> | Dp].
    + destruct (Y y Ip) as [-> | ->].
      * split; [apply (O2 q a I) | intros X; apply (O2 q a I), S, X].
      * split; auto.
    + rewrite (proj1 (A p Dp)) in Ip. split; [apply (O2 p y Ip) | intros X; apply (O2 p y Ip), S, X].
  - intros p y z Ip Iz. destruct (Nat.eq_dec p q) as [-> | Dp].
    + assert (near a x -> near x a) as Sym.
      { intros (d & E). unfold beside in E. 
        exists (match d with North => South | South => North | East => West | West => East end).
        destruct d; cbn; apply andb_true_iff in E as (E & E'); apply N.eqb_eq in E, E';
          apply andb_true_iff; split; apply N.eqb_eq; auto. }
      destruct (Y y Ip) as [-> | ->], (Y z Iz) as [-> | ->]; auto.
      destruct M; [subst; auto | auto].
    + rewrite (proj1 (A p Dp)) in Ip, Iz. exact (O3 p y z Ip Iz).
  - intros p c u Q. destruct (Nat.eq_dec p q) as [-> | Dp]; [congruence |].
    rewrite (proj2 (A p Dp)) in Q. rewrite (proj1 (A p Dp)). auto.
Qed.

Lemma in_order_next s s' : in_order s -> event s s' -> in_order s'.
Proof.
  intros O E. pose proof O as (O1 & O2 & O3 & O4). destruct E as
    [q c u v P D Tr No H' P' A | q x I H' P' (A & S) | q a x H M F B R H' P' A | S A].
  - destruct (O4 q c u P) as (H & C & <- & U).
    destruct (controller_parts c u C U) as (G & K). destruct (K v D) as (V & St & Lo).
    destruct (controller_parts c v C V) as (G' & _).
    unfold good_place in G'. destruct (free w (at_ c v)) eqn:F; [| discriminate].
    assert (~ In (at_ c v) (closed (about c))) as Cl.
    { intros X. rewrite negb_true_iff, <- not_true_iff_false in G'. apply G', existsb_exists.
      exists (at_ c v). split; [auto | apply N.eqb_refl]. }
    unfold good_step in St. rewrite !andb_true_iff in St. destruct St as ((Mv & Se) & _).
    rewrite forallb_forall in Se. fold (at_ c u) in Mv, Se. fold (at_ c v) in Mv, Se.
    apply (entered s s' (robot c) (at_ c u) (at_ c v)); auto.
    + destruct (N.eqb_spec (at_ c u) (at_ c v)); [auto | right].
      apply existsb_exists in Mv as (d & _ & Mv). apply andb_true_iff in Mv as (Mv & _).
      exists d; auto.
    + intros r Q N X. destruct (Lo r Q) as [Eq | (d & y & Y & Be)].
      * apply (O1 (robot c) r (at_ c v) Q (not_eq_sym N)); auto. rewrite H, Eq. left; auto.
      * destruct (Tr r _ d y Q N X Be Y) as [T | T]; [| auto]. apply T.
        specialize (Se _ Y). cbn in Se. rewrite Be in Se. cbn in Se. apply N.eqb_eq; auto.
  - assert (forall p y, In y (holds s' p) -> In y (holds s p)) as Y.
    { intros p y J. destruct (Nat.eq_dec p q) as [-> | Dp].
      - rewrite H' in J. destruct J as [<- | []]; auto.
      - rewrite (proj1 (A p Dp)) in J; auto. }
    split; [| split; [| split]].
    + intros p r y C N J J'. exact (O1 p r y C N (Y p y J) (Y r y J')).
    + intros p y J. destruct (O2 p y (Y p y J)) as (F & B). split; auto.
    + intros p y z J J'. exact (O3 p y z (Y p y J) (Y p z J')).
    + intros p c u Q. destruct (Nat.eq_dec p q) as [-> | Dp].
      * destruct (P' c u Q) as (T & Ro & U & <-). auto.
      * rewrite (proj2 (A p Dp)) in Q. rewrite (proj1 (A p Dp)). auto.
  - apply (entered s s' q a x); auto.
  - split; [| split; [| split]].
    + intros p r y C N. rewrite (proj1 (A p)), (proj1 (A r)). apply O1; auto.
    + intros p y J. rewrite (proj1 (A p)) in J. destruct (O2 p y J) as (F & B). split; auto.
      intros X. destruct (S p y X); auto.
    + intros p y z. rewrite (proj1 (A p)). apply O3.
    + intros p c u. rewrite (proj1 (A p)), (proj2 (A p)). apply O4.
Qed.

Lemma reached_in_order s : reached s -> in_order s.
Proof.
  induction 1 as [s B | s s' _ IH E]; [apply in_order_first | eapply in_order_next]; eauto.
Qed.

(** No two robots in conflict ever occupy one region, at rest or in transit. *)
Theorem never_meet s q r x : reached s -> conflict q r = true -> q <> r ->
  In x (holds s q) -> In x (holds s r) -> False.
Proof. intros R. apply (proj1 (reached_in_order s R)). Qed.

(** No robot is ever in a wall, or in an unresolved obstacle that blocks it. *)
Theorem never_in_an_obstacle s q x : reached s -> In x (holds s q) ->
  free w x = true /\ ~ shut s q x.
Proof. intros R. apply (proj1 (proj2 (reached_in_order s R))). Qed.
End Team.
