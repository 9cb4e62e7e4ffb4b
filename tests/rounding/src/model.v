(* What the goals assume of a rounding, of binary32 with subnormal numbers, to nearest, ties to even. *)

From Coq Require Import Reals Lra ZArith.
From Flocq Require Import Core Relative Plus_error.

Open Scope R_scope.

Notation exponents := (FLT_exp (-149) 24).
Notation number := (generic_format radix2 exponents).
Notation rounded := (round radix2 exponents ZnearestE).

(* 0x.ffffff000001p-24 *)
Definition delta := 281474959933441 / 4722366482869645213696.

(* 2^-150 *)
Definition eta := / 1427247692705959881058285969449495136382746624.

Lemma unit : u_ro radix2 24 / (1 + u_ro radix2 24) <= delta.
Proof.
unfold u_ro, delta. simpl bpow. lra.
Qed.

Local Instance has_digits : Prec_gt_0 24 := eq_refl.

Theorem sum : forall x y, number x -> number y ->
  exists d, Rabs d <= delta /\ rounded (x + y) = (x + y) * (1 + d).
Proof.
intros x y Fx Fy.
destruct (FLT_plus_error_N_ex radix2 (-149) 24 (fun z => negb (Z.even z)) x y Fx Fy) as [d [B E]].
exists d. split; [exact (Rle_trans _ _ _ B unit) | exact E].
Qed.

Theorem product_or_root : forall x,
  exists d e, Rabs d <= delta /\ Rabs e <= eta /\ rounded x = x * (1 + d) + e.
Proof.
intros x.
destruct (relative_error_N_FLT'_ex radix2 (-149) 24 eq_refl (fun z => negb (Z.even z)) x)
  as [d [e [B [T [_ E]]]]].
exists d, e. split; [exact (Rle_trans _ _ _ B unit) | split; [| exact E]].
apply (Rle_trans _ _ _ T). unfold eta. simpl bpow. lra.
Qed.

Print Assumptions sum.
Print Assumptions product_or_root.
