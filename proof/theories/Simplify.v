(** Partial evaluation, and all values that satisfy some formulas. *)
From Coq Require Import List NArith Arith Bool Lia.
From Proved Require Import Gr1.
Import ListNotations.

(** Known values of some references. *)
Definition known := ref -> option N.
Definition agrees (k : known) (s s' : state) : Prop :=
  forall r n, k r = Some n -> deref s s' r = n.

Fixpoint simp_term (k : known) (t : term) : term :=
  match t with
  | Const n => Const n
  | Ref r => match k r with Some n => Const n | None => Ref r end
  | Add a b => match simp_term k a, simp_term k b with
               | Const m, Const n => Const (m + n)
               | a', b' => Add a' b'
               end
  end.

Definition of_bool (b : bool) : form := if b then T else F.

Fixpoint simp (k : known) (f : form) : form :=
  match f with
  | T => T
  | F => F
  | Truth r => match k r with Some n => of_bool (negb (N.eqb n 0)) | None => Truth r end
  | Cmp c a b => match simp_term k a, simp_term k b with
                 | Const m, Const n => of_bool (compares c m n)
                 | a', b' => Cmp c a' b'
                 end
  | Not f => match simp k f with T => F | F => T | f' => Not f' end
  | And f g => match simp k f with
               | F => F
               | T => simp k g
               | f' => match simp k g with F => F | T => f' | g' => And f' g' end
               end
  | Or f g => match simp k f with
              | T => T
              | F => simp k g
              | f' => match simp k g with T => T | F => f' | g' => Or f' g' end
              end
  | Imp f g => match simp k f with
               | F => T
               | T => simp k g
               | f' => match simp k g with T => T | F => Not f' | g' => Imp f' g' end
               end
  | Iff f g => match simp k f, simp k g with
               | T, g' => g'
               | f', T => f'
               | F, F => T
               | f', g' => Iff f' g'
               end
  | Xor f g => match simp k f, simp k g with
               | F, g' => g'
               | f', F => f'
               | T, T => F
               | f', g' => Xor f' g'
               end
  end.

Lemma simp_term_ok k s s' t : agrees k s s' -> value s s' (simp_term k t) = value s s' t.
Proof.
  intros A; induction t as [n | r | a IHa b IHb]; simpl; auto.
  - destruct (k r) eqn:E; simpl; auto. symmetry; apply A; auto.
  - rewrite <- IHa, <- IHb. destruct (simp_term k a), (simp_term k b); reflexivity.
Qed.

Lemma of_bool_ok s s' b : sat s s' (of_bool b) = b.
Proof. destruct b; reflexivity. Qed.

Lemma simp_ok k s s' f : agrees k s s' -> sat s s' (simp k f) = sat s s' f.
Proof.
  intros A; induction f as [| | r | c a b | f IHf | f IHf g IHg | f IHf g IHg | f IHf g IHg
    | f IHf g IHg | f IHf g IHg]; try reflexivity;
    try (cbn [simp sat]; rewrite <- IHf, <- IHg; destruct (simp k f); try reflexivity;
      destruct (simp k g); try reflexivity; cbn [sat];
      repeat match goal with |- context [if ?b then _ else _] => destruct b end; reflexivity).
  - simpl. destruct (k r) eqn:E; simpl; auto.
    rewrite of_bool_ok, (A _ _ E); reflexivity.
  - pose proof (simp_term_ok k s s' a A) as Ha; pose proof (simp_term_ok k s s' b A) as Hb.
    cbn [simp sat]; rewrite <- Ha, <- Hb.
    destruct (simp_term k a), (simp_term k b); try reflexivity. apply of_bool_ok.
  - cbn [simp sat]; rewrite <- IHf. destruct (simp k f); reflexivity.
  - cbn [simp sat]; rewrite <- IHf, <- IHg.
    assert (forall b, Bool.eqb true b = b) by (intros []; reflexivity).
    assert (forall b, Bool.eqb b true = b) by (intros []; reflexivity).
    destruct (simp k f), (simp k g); cbn [sat]; auto.
  - cbn [simp sat]; rewrite <- IHf, <- IHg.
    assert (forall b, xorb false b = b) by (intros []; reflexivity).
    assert (forall b, xorb b false = b) by (intros []; reflexivity).
    destruct (simp k f), (simp k g); cbn [sat]; auto.
Qed.

(** Remainder of a list of clauses: empty if they hold, [[F]] if one does not. *)
Fixpoint simps (k : known) (fs : list form) : list form :=
  match fs with
  | [] => []
  | f :: fs => match simp k f with
               | F => [F]
               | T => simps k fs
               | f' => match simps k fs with [F] => [F] | fs' => f' :: fs' end
               end
  end.

Lemma simps_ok k s s' fs : agrees k s s' -> sats s s' (simps k fs) = sats s s' fs.
Proof.
  intros A; induction fs as [| f fs IH]; [reflexivity |].
  unfold sats in *; cbn [simps forallb]; rewrite <- IH, <- (simp_ok k s s' f A).
  assert (forall f', forallb (sat s s') match simps k fs with [F] => [F] | fs' => f' :: fs' end
          = sat s s' f' && forallb (sat s s') (simps k fs)) as H.
  { intros f'. destruct (simps k fs) as [| [] []]; cbn [forallb sat]; try reflexivity.
    symmetry; apply andb_false_r. }
  destruct (simp k f); try apply H; reflexivity.
Qed.

(** [cover p vs fs rows]: whatever values the variables [vs] have that satisfy [fs], there is a row
    with these values. [p]: the values of the next state are meant. *)
Definition at_ (p : bool) (x : var) : ref := if p then Next x else Now x.

Definition same_ref (a b : ref) : bool :=
  match a, b with
  | Now x, Now y => Nat.eqb x y
  | Next x, Next y => Nat.eqb x y
  | _, _ => false
  end.

Definition one (p : bool) (x : var) (n : N) : known :=
  fun r => if same_ref (at_ p x) r then Some n else None.

Definition get (row : list N) (x : var) : N := nth x row 0%N.

Fixpoint cover (p : bool) (vs : list (var * list N)) (fs : list form) (rows : list (list N))
  : bool :=
  match vs with
  | [] => match fs with
          | [] => match rows with [] => false | _ => true end
          | [F] => true
          | _ => false
          end
  | (x, ns) :: vs =>
      forallb (fun n => match simps (one p x n) fs with
                        | [F] => true
                        | fs' => cover p vs fs' (filter (fun row => N.eqb (get row x) n) rows)
                        end) ns
  end.

Definition has (s : state) (vs : list (var * list N)) : Prop :=
  forall x ns, In (x, ns) vs -> In (s x) ns.

Lemma cover_ok p vs : forall fs rows s s',
  cover p vs fs rows = true ->
  has (if p then s' else s) vs ->
  sats s s' fs = true ->
  exists row, In row rows /\ forall x ns, In (x, ns) vs -> get row x = (if p then s' else s) x.
Proof.
  induction vs as [| (x, ns) vs IH]; intros fs rows s s' C R H.
  - cbn [cover] in C. destruct fs as [| f fs].
    + destruct rows as [| row rows]; [discriminate |].
      exists row; split; [left; reflexivity | intros ? ? []].
    + exfalso. destruct f; try discriminate.
  - cbn [cover] in C. rewrite forallb_forall in C.
    set (v := if p then s' else s) in *.
    assert (In (v x) ns) as I by (apply R; left; reflexivity).
    specialize (C _ I).
    assert (agrees (one p x (v x)) s s') as A.
    { intros r n E. unfold one in E. destruct (same_ref (at_ p x) r) eqn:Q; [| discriminate].
      injection E as <-. unfold v, at_ in *.
      destruct p, r as [y | y]; cbn in Q; try discriminate;
        apply Nat.eqb_eq in Q; subst y; reflexivity. }
    pose proof (simps_ok _ _ _ fs A) as E. rewrite H in E.
    assert (cover p vs (simps (one p x (v x)) fs)
              (filter (fun row => N.eqb (get row x) (v x)) rows) = true) as C'.
    { destruct (simps (one p x (v x)) fs) as [| [] []]; auto. cbn in E; discriminate. }
    destruct (IH _ _ s s' C') as (row & I' & G); auto.
    { intros y ms J; apply R; right; auto. }
    apply filter_In in I' as (I' & Q). exists row; split; auto.
    intros y ms [J | J]; [| eapply G; eauto].
    injection J as <- <-. apply N.eqb_eq; auto.
Qed.

(** The values of a range. *)
Fixpoint count (n : N) (k : nat) : list N :=
  match k with O => [] | S k => n :: count (N.succ n) k end.
Definition values_of (r : N * N) : list N :=
  let (lo, hi) := r in count lo (N.to_nat (N.succ hi - lo)).

Lemma count_ok k : forall n m, (n <= m < n + N.of_nat k)%N -> In m (count n k).
Proof.
  induction k as [| k IH]; intros n m H; [lia |].
  destruct (N.eq_dec n m) as [-> | D]; [left; reflexivity |].
  right; apply IH; lia.
Qed.

Lemma values_of_ok lo hi n : (lo <= n <= hi)%N -> In n (values_of (lo, hi)).
Proof. intros H. apply count_ok. lia. Qed.

(** The variables from [x] on with their values. *)
Fixpoint numbered (x : var) (rs : list (N * N)) : list (var * list N) :=
  match rs with [] => [] | r :: rs => (x, values_of r) :: numbered (S x) rs end.

Lemma numbered_in rs : forall x y ns, In (y, ns) (numbered x rs) ->
  x <= y < x + length rs /\ exists r, nth_error rs (y - x) = Some r /\ ns = values_of r.
Proof.
  induction rs as [| r rs IH]; intros x y ns I; [destruct I |].
  destruct I as [I | I]; cbn [length].
  - injection I as <- <-. rewrite Nat.sub_diag. split; [lia | exists r; auto].
  - apply IH in I as (L & r' & E & ->). split; [lia |].
    exists r'. replace (y - x) with (S (y - S x)) by lia. auto.
Qed.

Lemma in_numbered rs : forall x y, x <= y < x + length rs -> exists ns, In (y, ns) (numbered x rs).
Proof.
  induction rs as [| r rs IH]; intros x y L; cbn [length] in L; [lia |].
  destruct (Nat.eq_dec x y) as [-> | D]; [exists (values_of r); left; reflexivity |].
  destruct (IH (S x) y) as (ns & I); [lia |]. exists ns; right; auto.
Qed.

Definition input_values (sp : spec) := numbered 0 (firstn (inputs sp) (ranges sp)).
Definition output_values (sp : spec) := numbered (inputs sp) (skipn (inputs sp) (ranges sp)).

Lemma nth_error_firstn {A} n : forall (l : list A) x a,
  nth_error (firstn n l) x = Some a -> x < n /\ nth_error l x = Some a.
Proof.
  induction n as [| n IH]; intros l x a E.
  - destruct x; discriminate.
  - destruct l as [| b l]; [destruct x; discriminate |].
    destruct x as [| x]; cbn in *; [split; [lia | auto] |].
    apply IH in E as (L & E). split; [lia | auto].
Qed.

Lemma nth_error_skipn {A} n : forall (l : list A) x, nth_error (skipn n l) x = nth_error l (n + x).
Proof.
  induction n as [| n IH]; intros l x; [reflexivity |].
  destruct l as [| b l]; [destruct x; reflexivity |]. apply IH.
Qed.

Lemma has_inputs sp s : (forall x, x < inputs sp -> within sp s x) -> has s (input_values sp).
Proof.
  intros W x ns I. apply numbered_in in I as (L & (lo, hi) & E & ->).
  rewrite Nat.sub_0_r in E. apply nth_error_firstn in E as (L' & E).
  apply values_of_ok. exact (W x L' lo hi E).
Qed.

Lemma has_outputs sp s : (forall x, inputs sp <= x -> within sp s x) -> has s (output_values sp).
Proof.
  intros W x ns I. apply numbered_in in I as (L & (lo, hi) & E & ->).
  rewrite nth_error_skipn in E.
  replace (inputs sp + (x - inputs sp)) with x in E by lia.
  apply values_of_ok. exact (W x (proj1 L) lo hi E).
Qed.

Lemma input_in sp x : x < inputs sp -> x < length (ranges sp) ->
  exists ns, In (x, ns) (input_values sp).
Proof. intros L M. apply in_numbered. rewrite firstn_length. lia. Qed.

Lemma output_in sp x : inputs sp <= x -> x < length (ranges sp) ->
  exists ns, In (x, ns) (output_values sp).
Proof. intros L M. apply in_numbered. rewrite skipn_length. lia. Qed.

(** The meaning of a formula depends only on the values. *)
Lemma value_ext s s' t t' u : (forall x, s x = t x) -> (forall x, s' x = t' x) ->
  value s s' u = value t t' u.
Proof.
  intros E E'; induction u as [| [x | x] | a IHa b IHb]; cbn; rewrite ?IHa, ?IHb; auto.
Qed.

Lemma sat_ext s s' t t' f : (forall x, s x = t x) -> (forall x, s' x = t' x) ->
  sat s s' f = sat t t' f.
Proof.
  intros E E'.
  induction f as [| | [x | x] | c a b | f IHf | f IHf g IHg | f IHf g IHg | f IHf g IHg
    | f IHf g IHg | f IHf g IHg]; cbn; rewrite ?IHf, ?IHg, ?E, ?E'; auto.
  rewrite (value_ext s s' t t' a), (value_ext s s' t t' b); auto.
Qed.

Lemma sats_ext s s' t t' fs : (forall x, s x = t x) -> (forall x, s' x = t' x) ->
  sats s s' fs = sats t t' fs.
Proof.
  intros E E'; induction fs as [| f fs IH]; [reflexivity |].
  unfold sats in *; cbn [forallb]. rewrite IH, (sat_ext s s' t t' f); auto.
Qed.
