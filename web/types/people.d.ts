// Documents of the routes of people and their rights. No browser loads this file.

export type Right = "view" | "operate" | "administer";
export type PersonRole = "viewer" | "operator" | "admin";

/** Who this browser is to the server; `mode` "open": whoever uses the machine, "token": whoever has the token. */
export type SignInDocument = {
  mode: "open" | "token" | "users";
  name: string | null;
  kind: "local" | "shared_token" | "user" | "service";
  role: PersonRole | null;
  rights: Right[];
  expires_utc: string | null;
};
export type UserDocument = {
  name: string;
  role: PersonRole;
  state: "active" | "invited" | "disabled";
  created_utc: string;
  last_seen_utc: string | null;
  locked_for_s: number | null;
};
/** `path`: of this server; it works once. */
export type InvitationDocument = { path: string; expires_utc: string };
export type UserCreated = { user: UserDocument; invitation: InvitationDocument | null };
export type UserSessionDocument = {
  id: string;
  user: string;
  address: string;
  browser: string;
  created_utc: string;
  last_seen_utc: string;
  expires_utc: string;
  current: boolean;
  streams: number;
};
export type ServiceTokenDocument = {
  id: string;
  name: string;
  prefix: string;
  scopes: Right[];
  created_by: string;
  created_utc: string;
  expires_utc: string | null;
  last_used_utc: string | null;
};
export type ServiceTokenCreated = { token: string; document: ServiceTokenDocument };
export type AuditEntry = {
  id: number;
  utc: string;
  who: string | null;
  kind: string;
  method: string;
  path: string;
  address: string;
  status: number;
  outcome: "done" | "refused" | "failed";
  repeated: number;
};
export type AuditPage = { entries: AuditEntry[]; next_before: number | null };
