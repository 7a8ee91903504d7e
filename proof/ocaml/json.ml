(* As much of JSON as automata and measures need: no escapes, no repeated keys. *)
type t = Null | Bool of bool | Num of float | Str of string | Arr of t list | Obj of (string * t) list
exception Bad of string

let parse (s : string) : t =
  let n = String.length s and i = ref 0 in
  let fail what = raise (Bad (Printf.sprintf "%s at byte %d" what !i)) in
  let rec blank () =
    if !i < n then match s.[!i] with ' ' | '\n' | '\t' | '\r' -> incr i; blank () | _ -> () in
  let peek () = if !i < n then s.[!i] else '\000' in
  let expect c = blank (); if peek () = c then incr i else fail (Printf.sprintf "no '%c'" c) in
  let word w v = let k = String.length w in
    if !i + k <= n && String.sub s !i k = w then (i := !i + k; v) else fail "no value" in
  let str () =
    expect '"'; let j = !i in
    while peek () <> '"' do if !i >= n || peek () = '\\' then fail "no plain string" else incr i done;
    incr i; String.sub s j (!i - 1 - j) in
  let rec value () = blank (); match peek () with
    | '{' -> incr i; blank (); if peek () = '}' then (incr i; Obj []) else members []
    | '[' -> incr i; blank (); if peek () = ']' then (incr i; Arr []) else items []
    | '"' -> Str (str ())
    | 't' -> word "true" (Bool true) | 'f' -> word "false" (Bool false) | 'n' -> word "null" Null
    | _ -> let j = !i in
        while (match peek () with '0' .. '9' | '-' | '+' | '.' | 'e' | 'E' -> true | _ -> false)
        do incr i done;
        (match float_of_string_opt (String.sub s j (!i - j)) with Some f -> Num f | None -> fail "no value")
  and items acc = let v = value () in blank (); match peek () with
    | ',' -> incr i; items (v :: acc) | ']' -> incr i; Arr (List.rev (v :: acc)) | _ -> fail "no ']'"
  and members acc = blank (); let k = str () in expect ':'; let v = value () in blank ();
    match peek () with
    | ',' -> incr i; members ((k, v) :: acc)
    | '}' -> incr i; let l = (k, v) :: acc in
        let keys = List.sort_uniq compare (List.map fst l) in
        if List.compare_lengths keys l < 0 then fail "a repeated key" else Obj (List.rev l)
    | _ -> fail "no '}'" in
  let v = value () in blank (); if !i < n then fail "more than one value" else v

let field k = function
  | Obj l -> (try List.assoc k l with Not_found -> raise (Bad ("no " ^ k)))
  | _ -> raise (Bad "no object")
let pairs = function Obj l -> l | _ -> raise (Bad "no object")
let list = function Arr l -> l | _ -> raise (Bad "no list")
let str = function Str s -> s | _ -> raise (Bad "no string")
let int = function Num f when Float.is_integer f && Float.abs f < 1e9 -> int_of_float f
  | _ -> raise (Bad "no integer")
let opt f = function Null -> None | v -> Some (f v)
