(** The scenario's own rules of movement, without a formula of the specification. *)
From Coq Require Import Ascii String List NArith Arith Bool FMapPositive Lia.
From Proved Require Import Gr1 Simplify Ranks Strategy Parse.
Import ListNotations.
Local Open Scope N_scope.

(** Cells are numbered row by row: is each of them free? *)
Record world := { columns : N; cells : list bool }.

(** Data known when a strategy is synthesized. [turns]: the robot has a heading. *)
Record circumstances := { closed : list N; turns : bool; others : list text }.

Inductive side := North | East | South | West.

Definition free (w : world) (r : N) : bool := nth (N.to_nat r) (cells w) false.
Definition row_of (w : world) (r : N) : N := r / columns w.
Definition column_of (w : world) (r : N) : N := r mod columns w.

(** Whether [b] lies next to [a] on that side. *)
Definition beside (w : world) (d : side) (a b : N) : bool :=
  match d with
  | North => (column_of w b =? column_of w a) && (row_of w b + 1 =? row_of w a)
  | South => (column_of w b =? column_of w a) && (row_of w b =? row_of w a + 1)
  | West => (row_of w b =? row_of w a) && (column_of w b + 1 =? column_of w a)
  | East => (row_of w b =? row_of w a) && (column_of w b =? column_of w a + 1)
  end.

Definition sides : list side := [North; East; South; West].
Definition number_of (d : side) : N := match d with North => 0 | East => 1 | South => 2 | West => 3 end.
Definition opposite (d : side) : N := match d with North => 2 | East => 3 | South => 0 | West => 1 end.
Definition busy_north : text := Eval compute in codes "busy_north".
Definition busy_east : text := Eval compute in codes "busy_east".
Definition busy_south : text := Eval compute in codes "busy_south".
Definition busy_west : text := Eval compute in codes "busy_west".
Definition busy (d : side) : text :=
  match d with North => busy_north | East => busy_east | South => busy_south | West => busy_west end.
Definition region_ : text := Eval compute in codes "region".
Definition heading_ : text := Eval compute in codes "heading".

(** A variable of that name, if there is one. *)
Definition of_name (ns : list (text)) (w : text) : option var :=
  match find_name (map (fun n => (n, true)) ns) 0%nat w with Some (x, _) => Some x | None => None end.

(** Where the robot may be. *)
Definition good_place (w : world) (c : circumstances) (r : N) : bool :=
  if free w r then negb (existsb (N.eqb r) (closed c)) else false.

(** Positions of the values for the pose of a robot and for its observations. *)
Record places := { region : var; heading : var; sees : list (side * var); tracks : list var }.

(** A step: to the same cell with the same heading, or forwards to a neighbouring one that is not
    observed to be occupied. *)
Definition good_step (w : world) (c : circumstances) (p : places) (s s' : state) : bool :=
  let r := s (region p) in
  let r' := s' (region p) in
  (if r =? r' then negb (turns c) || (s' (heading p) =? s (heading p))
   else existsb (fun d => beside w d r r' &&
          (negb (turns c) ||
           ((s' (heading p) =? number_of d) && negb (s (heading p) =? opposite d)))) sides)
  && forallb (fun dv => negb (beside w (fst dv) r r') || (s' (snd dv) =? 0)) (sees p)
  && forallb (fun x => negb (s' x =? r')) (tracks p).

Fixpoint somes {A} (l : list (option A)) : list A :=
  match l with [] => [] | Some a :: l => a :: somes l | None :: l => somes l end.

Definition places_of (ns : list text) (c : circumstances) : option places :=
  match of_name ns region_, of_name ns heading_, map (of_name ns) (others c) with
  | Some r, h, os =>
      match h, turns c, length (somes os) =? length os with
      | None, true, _ | _, _, false => None
      | _, _, true => Some {|
          region := r; heading := match h with Some x => x | None => 0%nat end;
          sees := somes (map (fun d => match of_name ns (busy d) with
                                       | Some x => Some (d, x) | None => None end) sides);
          tracks := somes os |}
      end
  | _, _, _ => None
  end%nat.

Definition keeps_node (w : world) (c : circumstances) (p : places) (g : graph) (u : node) : bool :=
  good_place w c (state_of u (region p)) &&
  match look g (next u) with
  | Some vs => forallb (fun v => good_step w c p (state_of u) (state_of v)) vs
  | None => false
  end.

Definition keeps (w : world) (c : circumstances) (p : places) (g : graph) : bool :=
  forallb (keeps_node w c p g) (all_of g).

Lemma forallb_ext' {A} (f h : A -> bool) l : (forall a, f a = h a) -> forallb f l = forallb h l.
Proof. intros E; induction l as [| a l IH]; cbn; rewrite ?E, ?IH; reflexivity. Qed.

(** Whatever the environment does within its rules: at each step the robot is in a free cell that
    is not closed, and each of its steps is a move. *)
Theorem keeps_sound sp g w c p :
  check sp g = true -> keeps w c p g = true ->
  forall i, (forall k x, (x < inputs sp)%nat -> within sp (i k) x) ->
  let b := play sp (strategy_of sp g) i in
  forall k, env_ok sp b k ->
  good_place w c (b k (region p)) = true /\
  forall j, (j < k)%nat -> good_step w c p (b j) (b (S j)) = true.
Proof.
  intros C K i W b k E. unfold keeps in K. rewrite forallb_forall in K. split.
  - destruct (at_all sp g C i W k E) as (u & _ & I & V). unfold b. rewrite V.
    apply K in I. unfold keeps_node in I. apply andb_true_iff in I; tauto.
  - intros j J. destruct (at_all sp g C i W j) as (u & A).
    { split; [apply E | intros; apply E; lia]. }
    destruct (at_next sp g C i W j u A) as (v & (_ & _ & V') & vs & L & M); [apply E; lia |].
    destruct A as (_ & I & V). apply K in I. unfold keeps_node in I.
    apply andb_true_iff in I as (_ & I). rewrite L, forallb_forall in I. apply I in M.
    rewrite <- M. unfold b, good_step. rewrite !V, !V'. f_equal; [f_equal |].
    + apply forallb_ext'. intros. rewrite V'. reflexivity.
    + apply forallb_ext'. intros. rewrite V'. reflexivity.
Qed.

(** * Targets *)

(** Some goal is met only by steps into one of these cells. *)
Definition reached_by (sp : spec) (p : places) (g : graph) (target : list N) (goal : form) : bool :=
  forallb (fun u => match look g (next u) with
    | Some vs => forallb (fun v => if sat (state_of u) (state_of v) goal
                                   then existsb (N.eqb (state_of v (region p))) target else true) vs
    | None => false
    end) (all_of g).

Definition visits (sp : spec) (p : places) (g : graph) (targets : list (list N)) : bool :=
  forallb (fun t => existsb (reached_by sp p g t) (sys_live sp)) targets.

(** Each target is visited infinitely often if the environment keeps its rules forever and meets
    each assumption infinitely often. *)
Theorem visits_sound sp g p targets :
  check sp g = true -> visits sp p g targets = true ->
  forall i, (forall k x, (x < inputs sp)%nat -> within sp (i k) x) ->
  let b := play sp (strategy_of sp g) i in
  (forall k, env_ok sp b k) -> (forall a, In a (env_live sp) -> again b a) ->
  forall t, In t targets -> forall k, exists j, (k <= j)%nat /\ In (b j (region p)) t.
Proof.
  intros C V i W b E A t I k. unfold visits in V. rewrite forallb_forall in V.
  specialize (V t I). apply existsb_exists in V as (goal & G & R).
  destruct (proj2 (check_realizes sp g C i W) E A goal G k) as (j & J & M).
  exists (S j); split; [lia |]. unfold reached_by in R. rewrite forallb_forall in R.
  destruct (at_all sp g C i W j (E j)) as (u & Q).
  destruct (at_next sp g C i W j u Q) as (v & (_ & _ & V') & vs & L & H).
  { apply (proj2 (E (S j)) j). lia. }
  destruct Q as (_ & U & V). apply R in U. rewrite L, forallb_forall in U. apply U in H.
  assert (sat (state_of u) (state_of v) goal = true) as M'.
  { rewrite <- M. symmetry. apply sat_ext; auto. }
  rewrite M' in H.
  apply existsb_exists in H as (n & N1 & N2). apply N.eqb_eq in N2. subst n.
  unfold b. rewrite V'. auto.
Qed.
